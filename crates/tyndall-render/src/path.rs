//! The light transport of one camera path.
//!
//! A path is a loop over *segments*: the ray up to the next surface, with the media spans on it. Each segment first
//! gathers the media's emission, then answers *scatter here* or *reach the end*. Direct light is sampled at every
//! scattering event and combined with directional sampling by the balance heuristic over **directional densities only**:
//! what the media between do to a path is a factor of both techniques and never part of the weights.
//!
//! The *camera's segment* is a path's first one that meets media: the camera ray itself, or where that meets none the one
//! that does. It is what the image guide learns about, pixel by pixel.

mod decoupled;
mod direct;
mod equiangular;
mod guidance;
mod guided;
mod lesson;
mod record;
mod roulette;
mod segment;
mod statistics;
mod surface;
mod training;
mod vertex;

pub(crate) use guidance::Guides;
use lesson::Learned;
pub use statistics::PathStatistics;

use crate::aov::SampleRecord;
use crate::filter::sample_offset;
use crate::world::{SegmentEnd, Unseen, World, WorldScratch};
use equiangular::Rival;
use glam::{Vec2, Vec3A};
use guidance::{Guidance, Guided, Unguided};
use record::Recorder;
use training::Trail;
use tyndall_guiding::EventClass;
use tyndall_guiding::field::TrainingSample;
use tyndall_math::Ray;
use tyndall_math::Rgb;
use tyndall_math::random::{PathSampler, Pcg};
use tyndall_scene::{LightSampling, PixelFilter, RenderSettings};
use vertex::Vertex;

/// Traces camera paths through a world.
pub(crate) struct Integrator<'a> {
    world: &'a World,
    resolution: [u32; 2],
    filter: PixelFilter,
    seed: u64,
    max_scatter: u32,
    lights_candidates: bool,
}

/// Working memory of one worker, reused over its samples.
pub(crate) type Scratch = WorldScratch;

/// How the direction of the current ray was chosen, for the weight of emitters it hits.
#[derive(Debug, Clone, Copy)]
struct Origin {
    /// The vertex it left.
    position: Vec3A,
    /// Density per steradian with which that vertex would sample this direction.
    pdf: f32,
    /// Chosen by a delta distribution (or the camera): no light sampling competes.
    is_delta: bool,
    /// If that vertex is a collision: the other technique that samples lights from its segment.
    rival: Option<Rival>,
    /// What that vertex is on, until the field's lesson has begun; `None` for the camera.
    vertex: Option<EventClass>,
}

/// A path in the making.
struct Path<'a, G> {
    world: &'a World,
    sampler: PathSampler,
    /// Numbers of unbounded count: free-flight candidates, ratio tracking.
    rng: Pcg,
    ray: Ray,
    /// When all of it happens: 0 when the shutter opens, 1 when it closes.
    time: f32,
    /// What rounding took from the origin of `ray`, see [`tyndall_math::SplitPoint`].
    low: Vec3A,
    origin: Origin,
    /// The light that is not opaque and was passed last since the origin.
    passed_light: Option<usize>,
    throughput: Rgb,
    /// Scattering events so far; at most `max_scatter`.
    scatter_count: u32,
    max_scatter: u32,
    recorder: Recorder,
    /// The same as in [`Origin`], of the collision at hand.
    rival: Option<Rival>,
    /// Chooses between volume and surface on the camera's segment, and is taken there: most of the noise in thin media, so
    /// it is stratified (a quarter less error in the jungle at 64 samples), with shifts if a guide answers to it.
    first_choice: Option<f32>,
    guidance: G,
}

/// What one path gives.
pub(crate) struct PathSample {
    pub(crate) record: SampleRecord,
    /// If the camera's segment was guided.
    pub(crate) learned: Option<Learned>,
}

impl<'a> Integrator<'a> {
    pub(crate) fn new(world: &'a World, settings: &RenderSettings) -> Self {
        Self {
            world,
            resolution: settings.resolution,
            filter: settings.filter,
            seed: settings.seed,
            max_scatter: settings.max_bounces,
            lights_candidates: settings.light_sampling == LightSampling::Candidate,
        }
    }

    pub(crate) fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    /// Sample number `sample` of a pixel: a pure function of its arguments and the seed.
    pub(crate) fn sample(
        &self,
        pixel: [u32; 2],
        sample: u64,
        guides: Guides<'_>,
        training: Option<&mut Vec<TrainingSample>>,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> PathSample {
        let pixel_id = u64::from(pixel[1]) * u64::from(self.resolution[0]) + u64::from(pixel[0]);
        let sampler = PathSampler::new(self.seed, pixel_id, sample);
        if guides.is_empty() && training.is_none() {
            let path = self.traced(pixel, sampler, Unguided, scratch, statistics);
            return PathSample { record: self.finish(path.recorder), learned: None };
        }
        let mut trail = Trail::default();
        let taught = training.is_some().then_some(&mut trail);
        let mut guidance = Guided::new(guides, taught, self.seed, pixel_id);
        guidance.lights_candidates = self.lights_candidates;
        let mut path = self.traced(pixel, sampler, guidance, scratch, statistics);
        if let Some(samples) = training {
            path.teach(samples);
        }
        let learned = path.guidance.lesson.take().map(|lesson| lesson.learn(&path.recorder, statistics));
        PathSample { record: self.finish(path.recorder), learned }
    }

    /// A path from the camera to its end.
    #[inline]
    fn traced<G: Guidance>(
        &self,
        pixel: [u32; 2],
        mut sampler: PathSampler,
        mut guidance: G,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> Path<'_, G> {
        let [film_x, film_y, lens_x, lens_y] = sampler.next_4d();
        let offset = sample_offset(self.filter, Vec2::new(film_x, film_y));
        let on_image = (Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + offset)
            / Vec2::new(self.resolution[0] as f32, self.resolution[1] as f32);
        // Without a lens the numbers for it are free.
        let camera = self.world.camera();
        let needs_more = camera.has_lens() && (self.world.has_media() || self.world.moves());
        let [choice, time] = if needs_more {
            let [choice, time, ..] = sampler.next_4d();
            [choice, time]
        } else {
            [lens_x, lens_y]
        };
        let is_guided = guidance.camera().is_some();
        let first_choice =
            self.world.has_media().then(|| if is_guided { guidance.shift(choice) } else { choice });
        let camera_ray = camera.ray(on_image, Vec2::new(lens_x, lens_y), time);
        let mut path = Path {
            world: self.world,
            rng: sampler.stream(0),
            sampler,
            ray: camera_ray.ray,
            time,
            low: Vec3A::ZERO,
            origin: Origin {
                position: camera_ray.ray.origin,
                pdf: 0.0,
                is_delta: true,
                rival: None,
                vertex: None,
            },
            passed_light: None,
            throughput: Rgb::ONE,
            scatter_count: 0,
            max_scatter: self.max_scatter,
            recorder: Recorder::new(&camera_ray),
            rival: None,
            first_choice,
            guidance,
        };
        statistics.paths += 1;
        if self.world.has_media() {
            path.trace::<true>(scratch, statistics);
        } else {
            path.trace::<false>(scratch, statistics);
        }
        path
    }

    fn finish(&self, recorder: Recorder) -> SampleRecord {
        recorder.finish(self.world.camera().exposure_scale(), self.world.origin())
    }
}

impl<G: Guidance> Path<'_, G> {
    /// The lights that the current ray does not meet.
    #[inline(always)]
    fn unseen(&self) -> Unseen {
        Unseen { is_camera_ray: self.scatter_count == 0, passed: self.passed_light }
    }

    /// The path loop. `MEDIA` compiles the media out of scenes that have none.
    fn trace<const MEDIA: bool>(&mut self, scratch: &mut Scratch, statistics: &mut PathStatistics) {
        loop {
            statistics.segments += 1;
            let end = self.world.trace(&self.ray, self.time, self.unseen());
            let event = self.sample_segment::<MEDIA>(&end, scratch, statistics);
            let goes_on = match (event, end) {
                (segment::Event::Scatter { t, phase }, _) => {
                    self.scatter_in_medium::<MEDIA>(t, phase, scratch, statistics)
                }
                (segment::Event::Pass, SegmentEnd::Surface(hit)) => {
                    self.scatter_at_surface::<MEDIA>(&hit, scratch, statistics)
                }
                (segment::Event::Pass, SegmentEnd::Light { index, t }) => self.add_light(index, t),
                (segment::Event::Pass, SegmentEnd::Escaped) => {
                    self.add_background();
                    false
                }
            };
            if !goes_on || !self.survives_roulette() {
                return;
            }
            self.begin_lesson();
        }
    }
}
