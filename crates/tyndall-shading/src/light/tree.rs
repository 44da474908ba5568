//! A tree of lights: the choice among very many at a cost that grows with the logarithm of their number.
//!
//! Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting",
//! doi:10.1145/3233305: clusters bounded by a box and a cone of directions, split by the surface area orientation
//! heuristic. Nodes have eight children instead of two: the bounds of clusters seven splits down are tighter than
//! those of two halves, eight come at the price of three pairs, and up to eight lights are simply weighed one by one.
//!
//! From the root on, one of two ways is followed. *Guided*: children in proportion to a bound of what they send to the
//! receiver. *Even*: in proportion to the number of their lights that are not certainly dark. The guided way knows
//! nothing of walls, and its weights may round to zero; the even one bounds what either can cost.

mod build;
mod lanes;
mod split;

#[cfg(test)]
mod tests;

pub(super) use build::TreeLight;

use super::Receiver;
use glam::Vec4;
use lanes::{LANES, Lanes, PointTarget, SegmentTarget, Weights};

/// Children of a node.
pub(super) const WIDTH: usize = 2 * LANES;

/// Bits of a slot in a trail.
const SLOT_BITS: u32 = WIDTH.trailing_zeros();

/// Where a child leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Child {
    /// To one light.
    Light(usize),
    /// To a node.
    Node(Node),
}

/// Where a node's children are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Node {
    /// The first four, by their index in the tree.
    first: usize,
    /// Four more follow.
    is_wide: bool,
}

/// The slots on the way from the root to a light, the root's in the lowest bits (the scheme of pbrt-4).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Trail(u64);

/// The lights that have a place.
#[derive(Debug, Clone)]
pub(super) struct LightTree {
    lanes: Vec<Lanes>,
    root: Node,
    /// Intensity of the root's brightest child, W/sr: the unit of its weights.
    unit: f64,
    /// Some cone leaves directions out.
    is_oriented: bool,
}

/// A receiver in the form that nodes are asked in.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target {
    Point(PointTarget),
    Surface(PointTarget),
    Segment(SegmentTarget),
}

/// The probabilities of one light by either way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shares {
    pub guided: f64,
    pub even: f64,
}

/// A chosen light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub light: usize,
    pub shares: Shares,
}

/// What the children of one node send to one receiver.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeWeights {
    importance: [f32; WIDTH],
    count: [f32; WIDTH],
    total_importance: f32,
    total_count: f32,
}

impl LightTree {
    /// The root's children, which also tell what the whole tree sends.
    #[inline]
    pub(super) fn weigh_root(&self, target: &Target) -> NodeWeights {
        self.weigh(self.root, target)
    }

    /// Expected irradiance from the whole tree, W/m^2; for segments the mean along them.
    #[inline]
    pub(super) fn irradiance(&self, root: &NodeWeights) -> f64 {
        f64::from(root.total_importance) * self.unit
    }

    /// Follows one way down. `None` where certainly nothing arrives from the part of the tree it led to.
    #[inline]
    pub(super) fn sample(
        &self,
        target: &Target,
        root: &NodeWeights,
        is_guided: bool,
        mut u: f64,
    ) -> Option<Found> {
        let (mut at, mut weights, mut shares) = (self.root, *root, Shares::ONE);
        loop {
            let slot = weights.choose(is_guided, &mut u)?;
            shares = shares.times(&weights.shares(slot));
            at = match self.child(at, slot) {
                Child::Light(light) => return Some(Found { light, shares }),
                Child::Node(node) => node,
            };
            weights = self.weigh(at, target);
        }
    }

    /// The probabilities with which [`Self::sample`] finds the light at the end of `trail`: the same products.
    #[inline]
    pub(super) fn shares(&self, target: &Target, root: &NodeWeights, trail: Trail) -> Shares {
        let (mut at, mut weights, mut shares) = (self.root, *root, Shares::ONE);
        let mut rest = trail.0;
        loop {
            let slot = rest as usize & (WIDTH - 1);
            rest >>= SLOT_BITS;
            shares = shares.times(&weights.shares(slot));
            at = match self.child(at, slot) {
                Child::Node(node) if shares.even > 0.0 => node,
                _ => return shares,
            };
            weights = self.weigh(at, target);
        }
    }

    #[inline]
    fn child(&self, node: Node, slot: usize) -> Child {
        Child::decode(self.lanes[node.first + slot / LANES].child[slot % LANES])
    }

    #[inline]
    fn weigh(&self, node: Node, target: &Target) -> NodeWeights {
        let first = &self.lanes[node.first];
        let second = node.is_wide.then(|| &self.lanes[node.first + 1]);
        match (target, self.is_oriented) {
            (Target::Point(it), false) => NodeWeights::of(first, second, |l| l.at_point::<false, false>(it)),
            (Target::Point(it), true) => NodeWeights::of(first, second, |l| l.at_point::<true, false>(it)),
            (Target::Surface(it), false) => NodeWeights::of(first, second, |l| l.at_point::<false, true>(it)),
            (Target::Surface(it), true) => NodeWeights::of(first, second, |l| l.at_point::<true, true>(it)),
            (Target::Segment(it), false) => NodeWeights::of(first, second, |l| l.along_segment::<false>(it)),
            (Target::Segment(it), true) => NodeWeights::of(first, second, |l| l.along_segment::<true>(it)),
        }
    }
}

impl NodeWeights {
    #[inline(always)]
    fn of(first: &Lanes, second: Option<&Lanes>, weigh: impl Fn(&Lanes) -> Weights) -> Self {
        const NOTHING: Weights = Weights { importance: Vec4::ZERO, count: Vec4::ZERO };
        let (a, b) = (weigh(first), second.map_or(NOTHING, weigh));
        let mut it = Self {
            importance: [0.0; WIDTH],
            count: [0.0; WIDTH],
            total_importance: (a.importance + b.importance).element_sum(),
            total_count: (a.count + b.count).element_sum(),
        };
        a.importance.write_to_slice(&mut it.importance);
        b.importance.write_to_slice(&mut it.importance[LANES..]);
        a.count.write_to_slice(&mut it.count);
        b.count.write_to_slice(&mut it.count[LANES..]);
        it
    }

    /// Whether something may arrive from one of the children.
    #[inline]
    pub(super) fn is_lit(&self) -> bool {
        self.total_count > 0.0
    }

    /// Probabilities of a child by either way.
    #[inline]
    fn shares(&self, slot: usize) -> Shares {
        if self.count[slot] <= 0.0 {
            return Shares { guided: 0.0, even: 0.0 };
        }
        let even = f64::from(self.count[slot]) / f64::from(self.total_count);
        let is_guided = self.total_importance > 0.0;
        let guided = f64::from(self.importance[slot]) / f64::from(self.total_importance);
        // Where all weights rounded to zero both ways are even.
        Shares { guided: if is_guided { guided } else { even }, even }
    }

    /// The child that `u` falls on, and `u` made uniform again.
    #[inline]
    fn choose(&self, is_guided: bool, u: &mut f64) -> Option<usize> {
        let (weights, total) = if is_guided && self.total_importance > 0.0 {
            (&self.importance, self.total_importance)
        } else {
            (&self.count, self.total_count)
        };
        let mut left = *u * f64::from(total);
        let mut last = None;
        for (slot, &weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let weight = f64::from(weight);
            last = Some(slot);
            *u = (left / weight).min(ONE_MINUS_EPSILON);
            if left < weight {
                break;
            }
            left -= weight;
        }
        last
    }
}

/// The largest f64 below one.
const ONE_MINUS_EPSILON: f64 = 1.0 - f64::EPSILON / 2.0;

impl Shares {
    pub(super) const ONE: Self = Self { guided: 1.0, even: 1.0 };

    #[inline]
    pub(super) fn times(&self, other: &Self) -> Self {
        Self { guided: self.guided * other.guided, even: self.even * other.even }
    }
}

impl Target {
    #[inline]
    pub(super) fn new(receiver: &Receiver) -> Self {
        match *receiver {
            Receiver::Point { position } => {
                Self::Point(PointTarget { position, normal: position, both_sides: true })
            }
            Receiver::Surface { position, normal, both_sides } => {
                Self::Surface(PointTarget { position, normal, both_sides })
            }
            Receiver::Segment { origin, direction, t0, t1 } => {
                Self::Segment(SegmentTarget::new(origin, direction, t0, t1))
            }
        }
    }
}

impl Child {
    const LIGHT: u32 = 1 << 31;

    fn encode(self) -> u32 {
        let (index, flag) = match self {
            Self::Light(index) => (index, Self::LIGHT),
            Self::Node(Node { first, is_wide }) => (first << 1 | usize::from(is_wide), 0),
        };
        assert!(index < Self::LIGHT as usize, "{index} is more than a tree can hold");
        index as u32 | flag
    }

    #[inline]
    fn decode(bits: u32) -> Self {
        let index = (bits & !Self::LIGHT) as usize;
        if bits & Self::LIGHT != 0 {
            Self::Light(index)
        } else {
            Self::Node(Node { first: index >> 1, is_wide: index & 1 == 1 })
        }
    }
}

impl Trail {
    /// The way to child `slot` of the node at `depth` (0 for the root) that this leads to.
    fn then(self, depth: u32, slot: usize) -> Self {
        Self(self.0 | (slot as u64) << (SLOT_BITS * depth))
    }
}
