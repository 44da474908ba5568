//! Where prims are drawn: instancers resolved, in f64, relative to the camera.

use super::place::Place;
use glam::{Affine3A, DAffine3, DVec3};
use rustc_hash::FxHashMap;
use tyndall_scene::prim::{Instancer, Prim};
use tyndall_scene::{Diagnostics, PrimPath, Scene};

/// Instancers may be nested this deep; deeper nesting is a cycle.
const MAX_NESTING: usize = 32;

/// Resolves the placements of instanced prims, each instancer once.
pub(super) struct Placements<'a> {
    scene: &'a Scene,
    resolved: FxHashMap<PrimPath, Vec<Place>>,
}

impl<'a> Placements<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        Self { scene, resolved: FxHashMap::default() }
    }

    /// Every place of a prim: its `own`, or one an instance.
    pub(super) fn of(
        &mut self,
        path: &PrimPath,
        own: Place,
        instancer: Option<&PrimPath>,
        diagnostics: &mut Diagnostics,
    ) -> Vec<Place> {
        let Some(instancer) = instancer else { return vec![own] };
        let instances = self.resolve(path, instancer, 0, diagnostics);
        instances.iter().map(|world_from_instance| world_from_instance.then(&own)).collect()
    }

    fn resolve(
        &mut self,
        user: &PrimPath,
        path: &PrimPath,
        depth: usize,
        diagnostics: &mut Diagnostics,
    ) -> Vec<Place> {
        if let Some(done) = self.resolved.get(path) {
            return done.clone();
        }
        let placements = match self.scene.get(path) {
            Some(Prim::Instancer(instancer)) if depth < MAX_NESTING => {
                self.compose(path, instancer, depth, diagnostics)
            }
            Some(Prim::Instancer(_)) => {
                diagnostics.error(path, "instancers contain each other", "break the cycle of parents");
                Vec::new()
            }
            _ => {
                let what = format!("instancer <{path}> does not exist");
                diagnostics.error(user, what, "the prim is not drawn; sync its instancer first");
                Vec::new()
            }
        };
        self.resolved.insert(path.clone(), placements.clone());
        placements
    }

    fn compose(
        &mut self,
        path: &PrimPath,
        instancer: &Instancer,
        depth: usize,
        diagnostics: &mut Diagnostics,
    ) -> Vec<Place> {
        if !instancer.visible {
            return Vec::new();
        }
        let own = own_places(instancer);
        let Some(parent) = &instancer.parent else { return own };
        let outer = self.resolve(path, parent, depth + 1, diagnostics);
        outer.iter().flat_map(|o| own.iter().map(move |inner| o.then(inner))).collect()
    }
}

/// Relative to the parent. Keys with another number of instances do not count.
fn own_places(instancer: &Instancer) -> Vec<Place> {
    let n_instances = instancer.transforms.len();
    let keys = || instancer.motion.iter().filter(|key| key.transforms.len() == n_instances);
    let place = |(i, at_frame): (usize, &DAffine3)| {
        Place::from_keys(*at_frame, keys().map(|key| (key.time, key.transforms[i])))
    };
    instancer.transforms.iter().enumerate().map(place).collect()
}

/// `world_from_object` for points stored relative to `center`, with the world's origin at the camera: subtracted in
/// f64, so distances from the stage's origin cost no precision.
pub(super) fn camera_relative(world_from_object: DAffine3, center: DVec3, origin: DVec3) -> Affine3A {
    relative_to(world_from_object, center, origin).as_affine3a()
}

/// [`camera_relative`] before it is rounded.
pub(super) fn relative_to(world_from_object: DAffine3, center: DVec3, origin: DVec3) -> DAffine3 {
    let mut placed = world_from_object * DAffine3::from_translation(center);
    placed.translation -= origin;
    placed
}

/// Whether a transform can place a surface: finite and invertible.
pub(super) fn is_invertible(transform: &DAffine3) -> bool {
    transform.is_finite() && {
        let m = transform.matrix3;
        let scale = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        scale > 0.0 && m.determinant().abs() > 1e-12 * scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use tyndall_scene::{DirtyBits, RenderDelegate};

    fn translate(x: f64) -> DAffine3 {
        DAffine3::from_translation(DVec3::new(x, 0.0, 0.0))
    }

    fn scene(instancers: Vec<(&str, Instancer)>) -> Arc<Scene> {
        let mut delegate = RenderDelegate::new();
        for (path, instancer) in instancers {
            delegate.sync(path.into(), Prim::Instancer(Arc::new(instancer)), DirtyBits::ALL);
        }
        delegate.commit()
    }

    fn instancer(offsets: &[f64], parent: Option<&str>) -> Instancer {
        let transforms = offsets.iter().map(|x| translate(*x)).collect();
        Instancer { transforms, motion: Vec::new(), parent: parent.map(PrimPath::from), visible: true }
    }

    #[test]
    fn nested_instancers_multiply() {
        let scene = scene(vec![
            ("/outer", instancer(&[0.0, 100.0], None)),
            ("/inner", instancer(&[1.0, 2.0, 3.0], Some("/outer"))),
        ]);
        let mut diagnostics = Diagnostics::default();
        let placements = Placements::new(&scene).of(
            &"/p".into(),
            Place::new(translate(0.5), &[]),
            Some(&"/inner".into()),
            &mut diagnostics,
        );
        let x: Vec<f64> = placements.iter().map(|p| p.at_frame.translation.x).collect();
        assert_eq!(x, [1.5, 2.5, 3.5, 101.5, 102.5, 103.5]);
        assert!(diagnostics.is_empty());
    }

    #[test]
    fn cycles_and_missing_instancers_are_reported() {
        let scene = scene(vec![("/a", instancer(&[0.0], Some("/b"))), ("/b", instancer(&[0.0], Some("/a")))]);
        let mut diagnostics = Diagnostics::default();
        let mut placements = Placements::new(&scene);
        for instancer in ["/a", "/c"] {
            let own = Place::new(DAffine3::IDENTITY, &[]);
            assert!(placements.of(&"/p".into(), own, Some(&instancer.into()), &mut diagnostics).is_empty());
        }
        assert_eq!(diagnostics.as_slice().len(), 2, "{diagnostics:?}");
    }

    #[test]
    fn large_offsets_vanish_relative_to_the_camera() {
        let far = DVec3::new(1e9, 0.0, -1e9);
        let placed = camera_relative(DAffine3::from_translation(far), DVec3::X, far);
        assert_eq!(placed.translation, glam::Vec3A::X);
    }

    #[test]
    fn singular_transforms_are_recognised_at_any_scale() {
        assert!(is_invertible(&DAffine3::from_scale(DVec3::splat(1e-9))));
        assert!(is_invertible(&DAffine3::from_scale(DVec3::new(-1.0, 1e-7, 1e6))));
        assert!(!is_invertible(&DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))));
        assert!(!is_invertible(&translate(f64::NAN)));
    }
}
