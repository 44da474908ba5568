//! Lights with a body: visible, opaque, and in the way of other lights.

use glam::Vec3A;
use tyndall_math::Ray;
use tyndall_shading::LightSet;

/// The lights that rays can hit, with their boxes.
#[derive(Debug, Default)]
pub(super) struct LightBodies {
    bodies: Vec<Body>,
}

#[derive(Debug)]
struct Body {
    light: usize,
    min: Vec3A,
    max: Vec3A,
}

impl LightBodies {
    pub(super) fn new(lights: &LightSet) -> Self {
        let bodies = (0..lights.lights.len())
            .filter_map(|light| lights.lights[light].bounds().map(|(min, max)| Body { light, min, max }))
            .collect();
        Self { bodies }
    }

    /// The nearest body along the ray.
    #[inline]
    pub(super) fn nearest(&self, lights: &LightSet, ray: &Ray) -> Option<(usize, f32)> {
        let mut ray = *ray;
        let mut found = None;
        for body in &self.bodies {
            if body.may_meet(&ray)
                && let Some(t) = lights.lights[body.light].intersect(&ray)
            {
                ray.t_max = t;
                found = Some((body.light, t));
            }
        }
        found
    }

    /// Whether a body other than that of light `except` is in the way.
    #[inline]
    pub(super) fn blocks(&self, lights: &LightSet, ray: &Ray, except: usize) -> bool {
        self.bodies.iter().any(|body| {
            body.light != except && body.may_meet(ray) && lights.lights[body.light].intersect(ray).is_some()
        })
    }
}

impl Body {
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
