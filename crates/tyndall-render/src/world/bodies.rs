//! Lights with a body: rays hit them, and the opaque ones are in the way of other lights.
//!
//! What a ray meets does not depend on how bodies are searched: every body is tested alike, against the whole ray, and
//! of equally near ones the last in the set counts.

use glam::Vec3A;
use tyndall_geometry::BoxTree;
use tyndall_math::Ray;
use tyndall_shading::LightSet;

/// Bodies up to this many are simply tried one after another.
const LINEAR: usize = 16;

/// Boxes count up to this factor beyond the nearest hit: the distance of a body, rounded, may be less than that of
/// its box.
const NEAREST_SLACK: f32 = 1.0 + 1e-3;

/// The lights that rays can hit, with their boxes.
#[derive(Debug, Default)]
pub(super) struct LightBodies {
    bodies: Vec<Body>,
    /// Over the bodies, if they are many.
    tree: Option<BoxTree>,
}

/// Which bodies a ray passes by.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Unseen {
    /// It comes from the camera: those that are not for camera rays.
    pub(crate) is_camera_ray: bool,
    /// It has just passed this light, which is not opaque and so shines but once.
    pub(crate) passed: Option<usize>,
}

impl Unseen {
    #[inline(always)]
    fn sees(&self, body: &Body) -> bool {
        (body.is_camera_visible || !self.is_camera_ray) && self.passed != Some(body.light)
    }
}

#[derive(Debug, Clone, Copy)]
struct Body {
    light: usize,
    is_camera_visible: bool,
    is_opaque: bool,
    min: Vec3A,
    max: Vec3A,
}

impl LightBodies {
    pub(super) fn new(lights: &LightSet) -> Self {
        let bodies: Vec<Body> = (0..lights.lights.len())
            .filter_map(|index| {
                let light = &lights.lights[index];
                let (is_camera_visible, is_opaque) = (light.is_camera_visible(), light.is_opaque());
                light.bounds().map(|(min, max)| Body { light: index, is_camera_visible, is_opaque, min, max })
            })
            .collect();
        let tree = (bodies.len() > LINEAR).then(|| BoxTree::build(bodies.iter().map(|b| (b.min, b.max))));
        Self { bodies, tree }
    }

    /// The nearest body along the ray that is not `unseen`: its light, and where.
    #[inline(always)]
    pub(super) fn nearest(&self, lights: &LightSet, ray: &Ray, unseen: Unseen) -> Option<(usize, f32)> {
        let mut nearest = None;
        let Some(tree) = &self.tree else {
            for body in self.bodies.iter().filter(|body| unseen.sees(body)) {
                body.meet(lights, ray, &mut nearest);
            }
            return nearest;
        };
        tree.for_each_met(ray, |index| {
            if unseen.sees(&self.bodies[index]) {
                self.bodies[index].meet(lights, ray, &mut nearest);
            }
            nearest.map_or(ray.t_max, |(_, t)| (t * NEAREST_SLACK).min(ray.t_max))
        });
        nearest
    }

    /// Whether an opaque body other than that of light `except` is in the way.
    #[inline(always)]
    pub(super) fn blocks(&self, lights: &LightSet, ray: &Ray, except: usize) -> bool {
        let is_in_the_way =
            |body: &Body| body.is_opaque && body.light != except && body.hit(lights, ray).is_some();
        let Some(tree) = &self.tree else { return self.bodies.iter().any(is_in_the_way) };
        let mut is_blocked = false;
        tree.for_each_met(ray, |index| {
            is_blocked = is_in_the_way(&self.bodies[index]);
            if is_blocked { -1.0 } else { ray.t_max }
        });
        is_blocked
    }
}

impl Body {
    /// Replaces `nearest` if the ray meets this body before.
    #[inline]
    fn meet(&self, lights: &LightSet, ray: &Ray, nearest: &mut Option<(usize, f32)>) {
        if let Some(t) = self.hit(lights, ray)
            && nearest.is_none_or(|(light, best)| t < best || t == best && self.light > light)
        {
            *nearest = Some((self.light, t));
        }
    }

    #[inline]
    fn hit(&self, lights: &LightSet, ray: &Ray) -> Option<f32> {
        if self.may_meet(ray) { lights.lights[self.light].intersect(ray) } else { None }
    }

    /// Slab test, conservative by the rounding of its few operations.
    #[inline]
    fn may_meet(&self, ray: &Ray) -> bool {
        let inverse = ray.direction.recip();
        let (a, b) = ((self.min - ray.origin) * inverse, (self.max - ray.origin) * inverse);
        let near = a.min(b).max_element().max(0.0);
        let far = a.max(b).min_element() * (1.0 + 2.0 * tyndall_math::GAMMA_3);
        // A ray in a face's plane gives NaN: then look closer.
        let passes_by = near > far || near > ray.t_max;
        !passes_by
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DQuat, DVec3};
    use std::path::Path;
    use std::sync::Arc;
    use tyndall_math::random::Pcg;
    use tyndall_scene::prim::{self, LightKind, Shaping};
    use tyndall_scene::{AssetError, AssetLoader, ColorSpace, Diagnostics, ImageData, PrimPath};
    use tyndall_shading::Light;

    struct NoAssets;

    impl AssetLoader for NoAssets {
        fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
            Err(AssetError { message: format!("{} does not exist", path.display()) })
        }
    }

    fn light(kind: LightKind, world_from_light: DAffine3) -> Light {
        let prim = prim::Light {
            world_from_light,
            kind,
            intensity: 1.0,
            exposure: 0.0,
            color: [1.0; 3],
            normalize: false,
            diffuse: 1.0,
            specular: 1.0,
            shaping: Shaping::default(),
            visible: true,
            camera_visible: true,
            opaque: true,
        };
        let path = PrimPath::from("/Light");
        Light::from_prim(&path, &prim, DVec3::ZERO, &NoAssets, &mut Diagnostics::default())
            .expect("it shines")
    }

    fn vector(rng: &mut Pcg) -> Vec3A {
        Vec3A::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - 1.0
    }

    /// Bodies of every kind, crowded; some turned, some along the axes, some in the same place twice.
    fn crowd(n: usize) -> LightSet {
        let mut rng = Pcg::new(&[n as u64]);
        let mut world_from_light = DAffine3::IDENTITY;
        let lights = (0..n)
            .map(|i| {
                let kind = match i % 4 {
                    0 => LightKind::Sphere { radius: 0.1, as_point: false },
                    1 => LightKind::Rect { width: 0.3, height: 0.2, texture: None },
                    2 => LightKind::Disk { radius: 0.1 },
                    _ => LightKind::Cylinder { length: 0.3, radius: 0.05, as_line: false },
                };
                let axis = vector(&mut rng).as_dvec3().normalize_or(DVec3::X);
                let angle = if i % 3 == 0 { 0.0 } else { 6.3 * f64::from(rng.next_f32()) };
                let turn = DQuat::from_axis_angle(axis, angle);
                let at = vector(&mut rng).as_dvec3();
                if i % 8 != 4 {
                    world_from_light = DAffine3::from_rotation_translation(turn, at);
                }
                light(kind, world_from_light)
            })
            .collect();
        LightSet::build(lights, 2.0)
    }

    #[test]
    fn the_tree_finds_what_the_loop_finds() {
        let set = crowd(300);
        let with_tree = LightBodies::new(&set);
        let one_by_one = LightBodies { tree: None, ..LightBodies::new(&set) };
        assert!(with_tree.tree.is_some() && LightBodies::new(&crowd(LINEAR)).tree.is_none());
        let mut rng = Pcg::new(&[3]);
        let mut n_met = 0;
        for i in 0..20_000 {
            let axis = [Vec3A::X, Vec3A::NEG_Y, Vec3A::Z][i % 3];
            let direction = if i % 5 == 0 { axis } else { vector(&mut rng).normalize_or(Vec3A::X) };
            // From outside, from between the bodies, and from inside one.
            let origin = match i % 3 {
                0 => vector(&mut rng) * 3.0,
                1 => vector(&mut rng),
                _ => with_tree.bodies[i % 300].min * 0.5 + with_tree.bodies[i % 300].max * 0.5,
            };
            let ray = Ray::new(origin, direction);
            let ray = if i % 4 == 0 { ray.up_to(rng.next_f32()) } else { ray };
            let (tree, list) = (
                with_tree.nearest(&set, &ray, Unseen::default()),
                one_by_one.nearest(&set, &ray, Unseen::default()),
            );
            let bits = |found: Option<(usize, f32)>| found.map(|(light, t)| (light, t.to_bits()));
            assert_eq!(bits(tree), bits(list), "{ray:?}");
            let except = tree.map_or(0, |(light, _)| light);
            assert_eq!(
                with_tree.blocks(&set, &ray, except),
                one_by_one.blocks(&set, &ray, except),
                "{ray:?}"
            );
            n_met += usize::from(tree.is_some());
        }
        assert!((2_000..19_000).contains(&n_met), "{n_met} rays of 20,000 met a body");
    }
}
