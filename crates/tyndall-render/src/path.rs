//! The light transport of one camera path.
//!
//! A path is a loop over *segments*: the ray up to the next surface, with the media spans on it. Each segment first
//! gathers the media's emission, then answers *scatter here* or *reach the end*. Direct light is sampled at every
//! scattering event and combined with directional sampling by the balance heuristic over **directional densities only**:
//! what the media between do to a path is a factor of both techniques and never part of the weights.

mod direct;
mod equiangular;
mod guided;
mod lesson;
mod record;
mod roulette;
mod segment;
mod statistics;
mod surface;
mod training;
mod vertex;

use lesson::Learned;
pub use statistics::PathStatistics;

use crate::aov::SampleRecord;
use crate::filter::sample_offset;
use crate::world::{SegmentEnd, World, WorldScratch};
use equiangular::Rival;
use glam::{Vec2, Vec3A};
use lesson::Lesson;
use record::Recorder;
use training::Trail;
use tyndall_guiding::field::{Field, TrainingSample};
use tyndall_guiding::{EventClass, SegmentGuide};
use tyndall_math::Ray;
use tyndall_math::Rgb;
use tyndall_math::random::{PathSampler, Pcg};
use tyndall_scene::{PixelFilter, RenderSettings};
use vertex::Vertex;

/// Traces camera paths through a world.
pub(crate) struct Integrator<'a> {
    world: &'a World,
    resolution: [u32; 2],
    filter: PixelFilter,
    seed: u64,
    max_scatter: u32,
}

/// Tells the numbers of [`Shifts`] from all others.
const SHIFT_PURPOSE: u64 = u64::MAX - 1;

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
struct Path<'a> {
    world: &'a World,
    sampler: PathSampler,
    /// Numbers of unbounded count: free-flight candidates, ratio tracking.
    rng: Pcg,
    ray: Ray,
    /// What rounding took from the origin of `ray`, see [`tyndall_math::SplitPoint`].
    low: Vec3A,
    origin: Origin,
    throughput: Rgb,
    /// Scattering events so far; at most `max_scatter`.
    scatter_count: u32,
    max_scatter: u32,
    recorder: Recorder,
    /// The same as in [`Origin`], of the collision at hand.
    rival: Option<Rival>,
    /// How the camera's segment chooses between volume and surface; taken there.
    first_choice: Option<FirstChoice>,
    /// What that choice was, until the path's end tells what it was worth.
    lesson: Option<Lesson>,
    field: Option<&'a Field>,
    shifts: Shifts,
    trail: Trail,
}

/// The choice between volume and surface on the camera's segment: most of the noise in thin media.
struct FirstChoice {
    /// A stratified number (a quarter less error in the jungle at 64 samples).
    u: f32,
    /// `None` tracks.
    guide: Option<SegmentGuide>,
}

/// What guides a path; nothing by default.
#[derive(Clone, Copy, Default)]
pub(crate) struct Guides<'a> {
    /// The choice between volume and surface on the camera's segment.
    pub(crate) camera: Option<SegmentGuide>,
    /// Directions at all vertices.
    pub(crate) field: Option<&'a Field>,
    /// How often they have learned. What a guide says depends on a pixel's earlier samples, and so do stratified
    /// numbers: those that are compared with guided probabilities are shifted anew after every lesson, or the image
    /// would be biased (by 1 % at two samples a pixel, where neighbours are few).
    pub(crate) epoch: u32,
}

/// Shifts of stratified numbers, modulo 1 (Cranley & Patterson 1976); the same for all samples of a pixel in an epoch,
/// which stay stratified among each other.
struct Shifts(Option<Pcg>);

impl Shifts {
    fn new(seed: u64, pixel: u64, epoch: u32) -> Self {
        Self((epoch > 0).then(|| Pcg::new(&[seed, pixel, u64::from(epoch), SHIFT_PURPOSE])))
    }

    #[inline]
    fn apply(&mut self, u: f32) -> f32 {
        match &mut self.0 {
            Some(shifts) => (u + shifts.next_f32()).fract(),
            None => u,
        }
    }
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
        mut training: Option<&mut Vec<TrainingSample>>,
        scratch: &mut Scratch,
        statistics: &mut PathStatistics,
    ) -> PathSample {
        let pixel_id = u64::from(pixel[1]) * u64::from(self.resolution[0]) + u64::from(pixel[0]);
        let mut sampler = PathSampler::new(self.seed, pixel_id, sample);
        let [film_x, film_y, lens_x, lens_y] = sampler.next_4d();
        let offset = sample_offset(self.filter, Vec2::new(film_x, film_y));
        let on_image = (Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5) + offset)
            / Vec2::new(self.resolution[0] as f32, self.resolution[1] as f32);
        // Without a lens the numbers for it are free.
        let has_lens = self.world.camera().has_lens();
        let mut shifts = Shifts::new(self.seed, pixel_id, guides.epoch);
        let first_choice = self.world.has_media().then(|| FirstChoice {
            u: shifts.apply(if has_lens { sampler.next_4d()[0] } else { lens_x }),
            guide: guides.camera,
        });
        let camera_ray = self.world.camera().ray(on_image, Vec2::new(lens_x, lens_y));
        let mut path = Path {
            world: self.world,
            rng: sampler.stream(0),
            sampler,
            ray: camera_ray.ray,
            low: Vec3A::ZERO,
            origin: Origin {
                position: camera_ray.ray.origin,
                pdf: 0.0,
                is_delta: true,
                rival: None,
                vertex: None,
            },
            throughput: Rgb::ONE,
            scatter_count: 0,
            max_scatter: self.max_scatter,
            recorder: Recorder::new(&camera_ray),
            rival: None,
            first_choice,
            lesson: None,
            field: guides.field,
            shifts,
            trail: Trail::new(training.is_some()),
        };
        statistics.paths += 1;
        if self.world.has_media() {
            path.trace::<true>(scratch, statistics);
        } else {
            path.trace::<false>(scratch, statistics);
        }
        if let Some(samples) = &mut training {
            path.teach(samples);
        }
        let learned = path.lesson.take().map(|lesson| lesson.learn(&path, statistics));
        PathSample { record: path.recorder.finish(self.world.camera().exposure_scale()), learned }
    }
}

impl Path<'_> {
    /// The path loop. `MEDIA` compiles the media out of scenes that have none.
    fn trace<const MEDIA: bool>(&mut self, scratch: &mut Scratch, statistics: &mut PathStatistics) {
        loop {
            statistics.segments += 1;
            let end = self.world.trace(&self.ray);
            let event = self.sample_segment::<MEDIA>(&end, scratch, statistics);
            let goes_on = match (event, end) {
                (segment::Event::Scatter { t, phase }, _) => {
                    self.scatter_in_medium::<MEDIA>(t, phase, scratch, statistics)
                }
                (segment::Event::Pass, SegmentEnd::Surface(hit)) => {
                    self.scatter_at_surface::<MEDIA>(&hit, scratch, statistics)
                }
                (segment::Event::Pass, SegmentEnd::Light { index, t }) => {
                    self.add_light(index, t);
                    false
                }
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
