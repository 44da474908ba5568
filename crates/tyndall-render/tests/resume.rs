//! A render that was stopped, at any moment, and goes on from what was saved makes the image of one that was not, and
//! has learned the same.

use glam::{DAffine3, DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tyndall_guiding::cache::{Cache, Fingerprint};
use tyndall_render::{Control, Film, SavedFilm, Session, World, WorldCache};
use tyndall_scene::prim::*;
use tyndall_scene::{
    AssetError, AssetLoader, ColorSpace, DirtyBits, DistanceSampling, Guiding, ImageData, RenderDelegate,
    RenderSettings,
};

/// Rendered of each pixel, in seven passes.
const SAMPLES: u32 = 64;

/// Scenes here are made of numbers alone.
struct NoFiles;

impl AssetLoader for NoFiles {
    fn image(&self, path: &Path, _: ColorSpace) -> Result<Arc<ImageData>, AssetError> {
        Err(AssetError { message: format!("{}: no files in this test", path.display()) })
    }
}

fn material(kind: &str, inputs: &[(&str, [f32; 3])], is_surface: bool) -> Prim {
    let input = |(name, value): &(&str, [f32; 3])| ((*name).to_owned(), NodeInput::Vector(*value));
    let node = ShadingNode { kind: kind.to_owned(), inputs: inputs.iter().map(input).collect() };
    let (surface, volume) = if is_surface { (Some(0), None) } else { (None, Some(0)) };
    Prim::Material(Arc::new(Material { nodes: vec![node], surface, volume }))
}

fn shape(kind: ShapeKind, place: [f64; 3], material: &str) -> Prim {
    Prim::Shape(Arc::new(Shape {
        world_from_object: DAffine3::from_translation(DVec3::from(place)),
        motion: Vec::new(),
        kind,
        primvars: BTreeMap::new(),
        material: Some(material.into()),
        instancer: None,
        visible: true,
    }))
}

/// A lamp behind a shade in a foggy room: light that comes by bounces.
fn world(settings: &RenderSettings) -> Arc<World> {
    let lamp = Prim::Light(Arc::new(Light {
        world_from_light: DAffine3::from_translation(DVec3::new(-1.2, 1.0, -1.0)),
        kind: LightKind::Sphere { radius: 0.2, as_point: false },
        intensity: 40.0,
        exposure: 0.0,
        color: [1.0; 3],
        normalize: false,
        diffuse: 1.0,
        specular: 1.0,
        shaping: Shaping::default(),
        visible: true,
        camera_visible: true,
        opaque: true,
    }));
    let camera = Prim::Camera(Arc::new(Camera {
        world_from_camera: DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.9)),
        aperture: DVec2::splat(1.0),
        focal_length: 0.7,
        ..Camera::default()
    }));
    let prims = [
        ("/room", shape(ShapeKind::Cube { size: 4.0 }, [0.0; 3], "/grey")),
        ("/grey", material("diffuse", &[("color", [0.6; 3])], true)),
        ("/shade", shape(ShapeKind::Cube { size: 1.0 }, [-0.6, 0.4, -0.4], "/grey")),
        ("/air", shape(ShapeKind::Cube { size: 3.9 }, [0.0; 3], "/fog")),
        ("/fog", material("volume", &[("scattering", [0.2; 3]), ("absorption", [0.02; 3])], false)),
        ("/lamp", lamp),
        ("/camera", camera),
    ];
    let mut delegate = RenderDelegate::new();
    for (path, prim) in prims {
        delegate.sync(path.into(), prim, DirtyBits::ALL);
    }
    Arc::new(World::build(&delegate.commit(), settings, &NoFiles, &mut WorldCache::default()).unwrap())
}

/// One shot, rendered as a whole, with what there is to be compared.
struct Shot {
    settings: RenderSettings,
    world: Arc<World>,
    expected: (Vec<u32>, Vec<u8>),
}

impl Shot {
    fn new(size: u32, guiding: Guiding, distance_sampling: DistanceSampling) -> Self {
        let settings = RenderSettings {
            resolution: [size, size],
            samples: 128,
            max_bounces: 3,
            threads: 2,
            guiding,
            distance_sampling,
            aovs: ["rgba", "variance"].map(String::from).to_vec(),
            ..RenderSettings::default()
        };
        let world = world(&settings);
        let mut shot = Self { settings, world, expected: Default::default() };
        let session = shot.session();
        session.render(&Control::default());
        shot.expected = result(&session);
        shot
    }

    /// Of half the samples that a trial needs to be worth it: one pass after the trial's is enough.
    fn session(&self) -> Session {
        let session = Session::new(self.world.clone(), self.settings.clone()).unwrap();
        session.restricted_to(0..SAMPLES).unwrap()
    }

    /// Goes on from `saved` to the end, and compares.
    fn check_rest(&self, saved: &[u8], moment: &str) {
        let SavedFilm { film, description, guide } = Film::read_state(saved).unwrap();
        assert_eq!(description, "a text");
        let session = self.session();
        session.resume(&film, guide.as_ref()).unwrap();
        session.render(&Control::default());
        let (image, learned) = result(&session);
        assert!(image == self.expected.0, "stopped {moment}, the image is another one");
        assert!(learned == self.expected.1, "stopped {moment}, something else was learned");
    }

    fn check_stops_after(&self, passes: &[u32]) {
        for &last in passes {
            let (session, control) = (self.session(), Control::default());
            let (mut pass, mut saved) = (0, Vec::new());
            session.render_watched(&control, &mut |snapshot| {
                pass += 1;
                if pass == last {
                    snapshot.write_state("a text", &mut saved).unwrap();
                    control.stop();
                }
            });
            self.check_rest(&saved, &format!("after pass {last}"));
        }
    }
}

/// The image's bits, and the cache of what was learned.
fn result(session: &Session) -> (Vec<u32>, Vec<u8>) {
    let film = session.film();
    let image = |name: &str| film.image(name).unwrap().into_iter().map(f32::to_bits);
    let learned = session.learned(&Fingerprint::default(), 1.0).map(|cache| cache.to_bytes());
    (image("rgba").chain(image("variance")).collect(), learned.unwrap_or_default())
}

#[test]
fn stopped_after_any_pass() {
    Shot::new(12, Guiding::On, DistanceSampling::Odds).check_stops_after(&[1, 2, 3, 4, 5, 6]);
    Shot::new(12, Guiding::On, DistanceSampling::NdsPlus).check_stops_after(&[3]);
    Shot::new(12, Guiding::Off, DistanceSampling::Target).check_stops_after(&[3]);
}

#[test]
fn stopped_before_and_after_a_trial() {
    // Large enough for a trial that is sure of something, and too small for one.
    for (size, passes) in [(64, &[5, 6][..]), (12, &[5, 6])] {
        let shot = Shot::new(size, Guiding::Auto, DistanceSampling::Auto);
        shot.check_stops_after(passes);
    }
}

#[test]
fn stopped_within_a_pass() {
    let shot = Shot::new(12, Guiding::On, DistanceSampling::Odds);
    let total = 12 * 12 * SAMPLES;
    for share in [0.02, 0.1, 0.3, 0.55, 0.9] {
        let (session, control) = (shot.session(), Control::default());
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while (control.samples_done() as f64) < share * f64::from(total) {
                    std::thread::yield_now();
                }
                control.stop();
            });
            session.render(&control);
        });
        let mut saved = Vec::new();
        session.write_state("a text", &mut saved).unwrap();
        shot.check_rest(&saved, &format!("after {share} of the samples"));
    }
}

#[test]
fn what_was_learned_before_a_stop_counts_once() {
    let shot = Shot::new(12, Guiding::On, DistanceSampling::Odds);
    let now = Fingerprint::default();
    let of_frame_1 = {
        let session = shot.session().restricted_to(0..32).unwrap();
        session.render(&Control::default());
        session.learned(&now, 1.0).expect("it learns")
    };
    let recalling = |cache: &Cache| {
        let session = shot.session();
        session.recall(cache.clone(), &now);
        session
    };
    let whole = recalling(&of_frame_1);
    whole.render(&Control::default());
    let whole = whole.learned(&now, 2.0).expect("it learns");
    assert_eq!((of_frame_1.samples, whole.samples), (32, 32 + SAMPLES));

    let (stopped, control) = (recalling(&of_frame_1), Control::default());
    stopped.render_watched(&control, &mut |snapshot| {
        if snapshot.film().min_samples() >= 16 {
            control.stop();
        }
    });
    let (saved_by_first, mut state) = (stopped.learned(&now, 2.0).expect("it learns"), Vec::new());
    stopped.write_state("", &mut state).unwrap();
    assert_eq!(saved_by_first.samples, 32 + 16);
    // The cache was written at the stop, or not since the process was killed.
    for cache in [saved_by_first, of_frame_1] {
        let session = recalling(&cache);
        let SavedFilm { film, guide, .. } = Film::read_state(&state).unwrap();
        session.resume(&film, guide.as_ref()).unwrap();
        session.render(&Control::default());
        let learned = session.learned(&now, 2.0).expect("it learns");
        assert_eq!((learned.samples, &learned.frames), (whole.samples, &whole.frames));
        assert!(learned.to_bytes() == whole.to_bytes());
    }
}

#[test]
fn guides_that_were_not_kept_are_missed() {
    let shot = Shot::new(8, Guiding::On, DistanceSampling::Odds);
    let session = shot.session();
    session.render(&Control::default());
    assert!(shot.session().resume(&session.film(), None).is_err());
    let other = Shot::new(8, Guiding::Off, DistanceSampling::Odds);
    let mut saved = Vec::new();
    session.write_state("", &mut saved).unwrap();
    let SavedFilm { film, guide, .. } = Film::read_state(&saved).unwrap();
    assert!(other.session().resume(&film, guide.as_ref()).is_err(), "these guides hold a field");
}
