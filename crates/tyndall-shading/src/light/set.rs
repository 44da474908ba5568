//! Which light to ask next.
//!
//! Lights with a place are the leaves of a [tree](super::tree); lights at infinity send the same everywhere. The
//! choice is a mixture of two: *guided* by a guess of what each light sends to the receiver, and *even* among all
//! lights that are not certainly dark there. The guess ignores occlusion and may round to zero; with the even share no
//! estimate is worse than by the factor `1 / EVEN_SHARE` than if lights were drawn blindly, and a light has
//! probability 0 only where it certainly sends nothing.

use super::bounds::Outreach;
use super::infinite::InfiniteLights;
use super::tree::{Found, LightTree, NodeWeights, Shares, Target, Trail, TreeLight, WIDTH};
use super::{Light, Receiver};
use glam::Vec3A;

/// Share of the even choice.
const EVEN_SHARE: f64 = 0.2;

/// The even choice between the tree and each light at infinity counts the tree as at most this many lights: the sun
/// must not vanish among a city's lamps.
const MOST_COUNTED: usize = WIDTH;

/// All lights of a scene.
#[derive(Debug, Clone)]
pub struct LightSet {
    /// The lights; indices into this are what sampling returns.
    pub lights: Vec<Light>,
    places: Vec<Place>,
    /// Middle and radius of a sphere around each light that has a place.
    spheres: Vec<Option<(Vec3A, f32)>>,
    tree: Option<LightTree>,
    infinite: InfiniteLights,
    /// Probabilities of the lights at infinity where nothing arrives from the tree, or there is none.
    infinite_alone: Vec<f32>,
    /// For the even choice: as how many lights the tree counts.
    tree_count: f64,
    scene_diameter: f64,
}

/// Where to find a light.
#[derive(Debug, Clone, Copy)]
enum Place {
    Tree(Trail),
    /// Its number among the lights at infinity.
    Infinite(u32),
}

/// What the tree sends to one receiver, and the chances of asking it.
struct Asked<'a> {
    tree: &'a LightTree,
    target: Target,
    root: NodeWeights,
    /// Chances of the tree as a whole.
    shares: Shares,
}

impl LightSet {
    /// Prepares the choice. Of a segment longer than the scene, whose radius is `scene_radius` (stage units), lights
    /// at infinity are taken to light the scene's diameter.
    ///
    /// Time is proportional to n log n; 100,000 lights take a fraction of a second.
    pub fn build(lights: Vec<Light>, scene_radius: f32) -> Self {
        let mut places = Vec::with_capacity(lights.len());
        let mut spheres = vec![None; lights.len()];
        let (mut local, mut infinite) = (Vec::new(), Vec::new());
        for (index, light) in lights.iter().enumerate() {
            places.push(match light.outreach() {
                Outreach::Local(bounds) => {
                    spheres[index] = Some((bounds.center(), 0.5 * (bounds.max - bounds.min).length()));
                    local.push(TreeLight { light: index as u32, bounds });
                    Place::Tree(Trail::default())
                }
                Outreach::Infinite { irradiance } => {
                    infinite.push((index, irradiance));
                    Place::Infinite(infinite.len() as u32 - 1)
                }
            });
        }
        let tree_count = local.len().min(MOST_COUNTED) as f64;
        let tree = LightTree::build(local, |light, trail| places[light] = Place::Tree(trail));
        let infinite = InfiniteLights::new(&infinite);
        let even = 1.0 / infinite.len() as f64;
        let infinite_alone =
            (0..infinite.len()).map(|i| mixture(&Shares { guided: infinite.share(i), even })).collect();
        let scene_diameter = 2.0 * f64::from(scene_radius.clamp(f32::MIN_POSITIVE, f32::MAX));
        Self { lights, places, spheres, tree, infinite, infinite_alone, tree_count, scene_diameter }
    }

    /// Whether some light comes from a place, not from infinity.
    #[inline]
    pub fn has_local(&self) -> bool {
        self.tree.is_some()
    }

    /// Middle and radius (stage units, camera-relative world) of a sphere around light `index`; `None` for lights at
    /// infinity.
    #[inline]
    pub fn bounding_sphere(&self, index: usize) -> Option<(Vec3A, f32)> {
        self.spheres.get(index).copied().flatten()
    }

    /// Chooses a light for the receiver by `u` in [0, 1): its index and the probability of that choice. `None` if
    /// nothing arrives from any light, or from the part of the lights that the choice led to.
    #[inline(always)]
    pub fn sample_light(&self, receiver: &Receiver, u: f32) -> Option<(usize, f32)> {
        if self.lights.len() <= 1 {
            return (!self.lights.is_empty()).then_some((0, 1.0));
        }
        let asked = self.ask_tree(receiver);
        let is_guided = f64::from(u) >= EVEN_SHARE;
        let u = if is_guided {
            (f64::from(u) - EVEN_SHARE) / (1.0 - EVEN_SHARE)
        } else {
            f64::from(u) / EVEN_SHARE
        };
        let Some(asked) = asked else { return self.choose_infinite(is_guided, u) };
        let tree_share = if is_guided { asked.shares.guided } else { asked.shares.even };
        if u < tree_share {
            let Found { light, shares } = asked.sample(is_guided, u / tree_share)?;
            return Some((light, mixture(&shares)));
        }
        let number = self.infinite_at(is_guided, (u - tree_share) / (1.0 - tree_share))?;
        Some((self.infinite.light(number), mixture(&self.infinite_shares(&asked, number))))
    }

    /// The probability with which [`Self::sample_light`] chooses light `index` for the receiver.
    #[inline]
    pub fn probability(&self, receiver: &Receiver, index: usize) -> f32 {
        let Some(place) = self.places.get(index) else { return 0.0 };
        if self.lights.len() == 1 {
            return 1.0;
        }
        let asked = self.ask_tree(receiver);
        match (place, asked) {
            (Place::Infinite(number), None) => self.infinite_alone[*number as usize],
            (Place::Infinite(number), Some(asked)) => {
                mixture(&self.infinite_shares(&asked, *number as usize))
            }
            (Place::Tree(_), None) => 0.0,
            (Place::Tree(trail), Some(asked)) => mixture(&asked.shares_of(*trail)),
        }
    }

    /// Weighs the tree against the lights at infinity. `None` if certainly nothing arrives from it.
    #[inline]
    fn ask_tree(&self, receiver: &Receiver) -> Option<Asked<'_>> {
        let tree = self.tree.as_ref()?;
        let target = Target::new(receiver);
        let root = tree.weigh_root(&target);
        if !root.is_lit() {
            return None;
        }
        let shares = if self.infinite.len() == 0 {
            Shares::ONE
        } else {
            let from_tree = tree.irradiance(&root) * receiver.local_factor(self.scene_diameter);
            let even = self.tree_count / (self.tree_count + self.infinite.len() as f64);
            let guided = from_tree / (from_tree + self.infinite.irradiance());
            Shares { guided: if guided.is_finite() { guided } else { even }, even }
        };
        Some(Asked { tree, target, root, shares })
    }

    /// A choice among the lights at infinity alone.
    #[inline]
    fn choose_infinite(&self, is_guided: bool, u: f64) -> Option<(usize, f32)> {
        let number = self.infinite_at(is_guided, u)?;
        Some((self.infinite.light(number), self.infinite_alone[number]))
    }

    #[inline]
    fn infinite_at(&self, is_guided: bool, u: f64) -> Option<usize> {
        match (self.infinite.len(), is_guided) {
            (0, _) => None,
            (_, true) => Some(self.infinite.choose(u)),
            (_, false) => Some(self.infinite.choose_evenly(u)),
        }
    }

    /// The chances of light `number` at infinity beside a tree.
    #[inline]
    fn infinite_shares(&self, asked: &Asked, number: usize) -> Shares {
        Shares {
            guided: (1.0 - asked.shares.guided) * self.infinite.share(number),
            even: (1.0 - asked.shares.even) / self.infinite.len() as f64,
        }
    }
}

impl Asked<'_> {
    #[inline]
    fn sample(&self, is_guided: bool, u: f64) -> Option<Found> {
        let Found { light, shares } = self.tree.sample(&self.target, &self.root, is_guided, u)?;
        Some(Found { light, shares: self.shares.times(&shares) })
    }

    #[inline]
    fn shares_of(&self, trail: Trail) -> Shares {
        self.shares.times(&self.tree.shares(&self.target, &self.root, trail))
    }
}

/// The probability of a choice whose chances are `shares`.
#[inline]
fn mixture(shares: &Shares) -> f32 {
    ((1.0 - EVEN_SHARE) * shares.guided + EVEN_SHARE * shares.even) as f32
}
