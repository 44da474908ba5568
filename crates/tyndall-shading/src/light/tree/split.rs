//! Splitting a cluster in two by the surface area orientation heuristic (Conty Estevez & Kulla 2018, equation 1), binned.
//!
//! The orientation of a side is estimated from the mean of its axes: bounding cones for every bin would be half of the
//! time that building takes. The bounds of what is split are exact.

use super::TreeLight;
use crate::light::bounds::{Cone, LightBounds, solid_angle};
use glam::{DVec3, Vec3A};
use std::f64::consts::PI;

/// Most bins along an axis; as many as there are lights if these are fewer.
const BINS: usize = 12;

/// What lies in a bin, or on one side of a split.
#[derive(Clone, Copy)]
struct Side {
    min: Vec3A,
    max: Vec3A,
    intensity: f64,
    sum_of_axes: DVec3,
    widest: Cone,
    n_lights: u32,
}

/// A plane between two bins.
struct Plane {
    cost: f64,
    axis: usize,
    /// First bin of the upper side.
    bin: usize,
}

/// Maps positions along an axis to bins.
struct Binning {
    low: f64,
    bins_per_unit: f64,
    n_bins: usize,
}

/// Reorders at least two lights so that the first of the returned number are one cluster and the rest another.
pub(super) fn split(lights: &mut [TreeLight], bounds: &LightBounds) -> usize {
    if lights.len() == 2 {
        return 1;
    }
    let centers = CenterBox::around(lights);
    let best = (0..3).filter_map(|axis| best_plane(lights, bounds, &centers, axis));
    // The first of equals: the result is a function of the lights and their order.
    let Some(best) = best.min_by(|a, b| a.cost.total_cmp(&b.cost)) else {
        return halve(lights, &centers);
    };
    let binning = centers.binning(best.axis, lights.len());
    let n_lower = partition(lights, |light| binning.bin(center(light)[best.axis]) < best.bin);
    if (1..lights.len()).contains(&n_lower) { n_lower } else { halve(lights, &centers) }
}

/// Cuts into halves of equal number.
pub(super) fn halve_lights(lights: &mut [TreeLight]) -> usize {
    let centers = CenterBox::around(lights);
    halve(lights, &centers)
}

fn halve(lights: &mut [TreeLight], centers: &CenterBox) -> usize {
    let axis = centers.longest_axis();
    let half = lights.len() / 2;
    lights.select_nth_unstable_by(half, |a, b| {
        center(a)[axis].total_cmp(&center(b)[axis]).then(a.light.cmp(&b.light))
    });
    half
}

/// The cheapest plane across `axis`; `None` if all centres lie on one.
fn best_plane(lights: &[TreeLight], bounds: &LightBounds, centers: &CenterBox, axis: usize) -> Option<Plane> {
    let binning = centers.binning(axis, lights.len());
    if !(binning.bins_per_unit > 0.0 && binning.bins_per_unit.is_finite()) {
        return None;
    }
    let mut bins = [Side::EMPTY; BINS];
    for light in lights {
        let bin = &mut bins[binning.bin(center(light)[axis])];
        *bin = bin.and(&Side::of(&light.bounds));
    }
    let mut upper = bins;
    for bin in (0..binning.n_bins - 1).rev() {
        upper[bin] = upper[bin].and(&upper[bin + 1]);
    }
    let stretch = stretch(bounds, axis);
    let mut lower = Side::EMPTY;
    let mut best: Option<Plane> = None;
    for bin in 1..binning.n_bins {
        let added = &bins[bin - 1];
        lower = lower.and(added);
        // An empty bin moves the plane past no light; the last ones leave none above.
        if added.n_lights == 0 || upper[bin].n_lights == 0 {
            continue;
        }
        let cost = stretch * (lower.cost() + upper[bin].cost());
        if best.as_ref().is_none_or(|best| cost < best.cost) {
            best = Some(Plane { cost, axis, bin });
        }
    }
    best
}

impl Side {
    const EMPTY: Self = Self {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
        intensity: 0.0,
        sum_of_axes: DVec3::ZERO,
        widest: Cone { axis: DVec3::Z, theta_o: 0.0, theta_e: 0.0 },
        n_lights: 0,
    };

    fn of(light: &LightBounds) -> Self {
        let LightBounds { min, max, cone, intensity } = *light;
        Self { min, max, intensity, sum_of_axes: cone.axis, widest: cone, n_lights: 1 }
    }

    fn and(&self, other: &Self) -> Self {
        let (a, b) = (&self.widest, &other.widest);
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            intensity: self.intensity + other.intensity,
            sum_of_axes: self.sum_of_axes + other.sum_of_axes,
            widest: Cone { theta_o: a.theta_o.max(b.theta_o), theta_e: a.theta_e.max(b.theta_e), ..*a },
            n_lights: self.n_lights + other.n_lights,
        }
    }

    /// As [`LightBounds::cost`], with the spread of the axes about their mean in place of the bounding cone.
    fn cost(&self) -> f64 {
        let diagonal2 = (self.max.as_dvec3() - self.min.as_dvec3()).length_squared();
        let concentration = self.sum_of_axes.length() / f64::from(self.n_lights);
        let is_spread = self.widest.theta_o < PI;
        let spread = if is_spread { concentration.min(1.0).acos() } else { 0.0 };
        self.intensity * diagonal2 * solid_angle(self.widest.theta_o + spread, self.widest.theta_e)
    }
}

/// K_r of equation 1: planes across a short side make thin boxes.
fn stretch(bounds: &LightBounds, axis: usize) -> f64 {
    let size = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    size.max_element() / size[axis]
}

fn center(light: &TreeLight) -> DVec3 {
    light.bounds.center().as_dvec3()
}

/// The box around the centres of lights.
struct CenterBox {
    min: DVec3,
    max: DVec3,
}

impl CenterBox {
    fn around(lights: &[TreeLight]) -> Self {
        let empty = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        lights.iter().map(center).fold(empty, |all, c| Self { min: all.min.min(c), max: all.max.max(c) })
    }

    fn longest_axis(&self) -> usize {
        let size = self.max - self.min;
        (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0)
    }

    fn binning(&self, axis: usize, n_lights: usize) -> Binning {
        let n_bins = n_lights.min(BINS);
        let low = self.min[axis];
        Binning { low, bins_per_unit: n_bins as f64 / (self.max[axis] - low), n_bins }
    }
}

impl Binning {
    fn bin(&self, x: f64) -> usize {
        (((x - self.low) * self.bins_per_unit) as usize).min(self.n_bins - 1)
    }
}

/// Moves the lights for which `is_first` to the front and returns their number.
fn partition(lights: &mut [TreeLight], is_first: impl Fn(&TreeLight) -> bool) -> usize {
    let mut n_first = 0;
    for i in 0..lights.len() {
        if is_first(&lights[i]) {
            lights.swap(i, n_first);
            n_first += 1;
        }
    }
    n_first
}

/// The bounds of a cluster, of which there must be one light at least.
pub(super) fn bounds_of(lights: &[TreeLight]) -> LightBounds {
    let sum = lights.iter().fold(Side::EMPTY, |sum, light| sum.and(&Side::of(&light.bounds)));
    let cone = cone_of(lights, &sum);
    LightBounds { min: sum.min, max: sum.max, cone, intensity: sum.intensity }
}

/// A cone around the mean of the axes: narrower than one union after another, which turns and widens at each.
fn cone_of(lights: &[TreeLight], sum: &Side) -> Cone {
    let Cone { theta_o, theta_e, .. } = sum.widest;
    if theta_o >= PI {
        return Cone { theta_e, ..Cone::SPHERE };
    }
    let cones = || lights.iter().map(|light| light.bounds.cone);
    let Some(axis) = sum.sum_of_axes.try_normalize() else {
        return cones().reduce(|a, b| a.union(&b)).unwrap_or(Cone::SPHERE);
    };
    let chord = cones().map(|cone| (cone.axis - axis).length_squared()).fold(0.0, f64::max).sqrt();
    let reach = theta_o + 2.0 * (0.5 * chord).min(1.0).asin();
    if reach < PI { Cone { axis, theta_o: reach, theta_e } } else { Cone { theta_e, ..Cone::SPHERE } }
}
