//! What guides a path, as a type: of an [`Unguided`] path nothing of guiding is left in the compiled loop, neither a
//! test nor a byte (it cost 3 to 8 % of the time of scenes that are not guided).

mod shifts;
mod unguided;

pub(super) use unguided::Unguided;

use super::lesson::Lesson;
use super::record::Recorder;
use super::training::Trail;
use super::vertex::Vertex;
use glam::{Vec2, Vec3A};
use shifts::Shifts;
use tyndall_guiding::directional::VmfMixture;
use tyndall_guiding::field::{Field, Region};
use tyndall_guiding::{FurtherSegments, SegmentGuide};
use tyndall_math::random::Pcg;
use tyndall_shading::Spread;

/// A direction is drawn from the field no more often than this: what the field does not know must still be found.
/// (Underwater .271 of error with three quarters at the most, .277 with one half.)
const MAX_SHARE: f32 = 0.75;
/// Less is not worth its densities.
const MIN_SHARE: f32 = 0.15;
/// Events of a path at which the field is asked. Later ones carry little and cost as much (kitchen: .204 of error with all
/// events, .207 with four, at .93 of the time).
const GUIDED_EVENTS: u32 = 4;
/// Events of a path whose directions are guided, the first ones where the field narrows what the vertex does: products and densities are most of what guiding costs, and each multiplies
/// the path's weight by up to two where the field is wrong. Error times time over those of unguided renders, with odds, of
/// four, two, one and none: underwater .91 .91 .83 .88; kitchen 1.42 1.32 1.30 1.35; jungle 1.62 1.59 1.45 1.28.
const DIRECTED_EVENTS: u32 = 1;
/// Samples a region must have seen for its radiance to end paths.
const FEWEST_SAMPLES: f32 = 64.0;

/// What guides a path; nothing by default.
#[derive(Clone, Copy, Default)]
pub(crate) struct Guides<'a> {
    /// Number of the combination that is tried, in a trial.
    pub(crate) arm: usize,
    /// The choice between volume and surface on the camera's segment.
    pub(crate) camera: Option<SegmentGuide>,
    /// What is known about all vertices.
    pub(crate) field: Option<&'a Field>,
    /// Whether the field guides directions.
    pub(crate) directs: bool,
    /// Whether the camera's choice is to be learned from, even if nothing guides it.
    pub(crate) learns_choice: bool,
    /// How the field chooses between volume and surface on the segments that leave them; `None` tracks.
    pub(crate) further: Option<FurtherSegments>,
    /// How often they have learned. What a guide says depends on a pixel's earlier samples, and so do stratified
    /// numbers: those that are compared with guided probabilities are shifted anew after every lesson, or the image
    /// would be biased (by 1 % at two samples a pixel, where neighbours are few). Others are not: a mist above a floor would
    /// have three times its variance.
    pub(crate) epoch: u32,
}

impl Guides<'_> {
    /// Whether there is neither anything to follow nor to learn.
    pub(crate) fn is_empty(&self) -> bool {
        self.camera.is_none() && self.field.is_none() && !self.learns_choice
    }
}

/// What a path asks of its guides, and where it notes what it learned.
pub(super) trait Guidance {
    /// Directions at a vertex.
    type Directions: Directions;

    /// How the camera's segment chooses between volume and surface; `None` tracks.
    fn camera(&self) -> Option<SegmentGuide>;

    /// The same for the segment that leaves the last event in this direction, once.
    fn further(&mut self, direction: Vec3A) -> Option<SegmentGuide>;

    /// What the light that arrives at a vertex adds to where the vertex would look for it; `None` where that is next to
    /// nothing, or the vertex scatters too narrowly to follow it.
    ///
    /// All techniques that sample the light at a vertex must get the same answer, or their weights do not add up: it
    /// depends on the events that were counted before.
    fn directions(&mut self, vertex: &Vertex<'_>, rng: &mut Pcg) -> Option<Self::Directions>;

    /// The path scatters at the last vertex asked about, and `is_guided` if the field has a say in its direction.
    fn count_event(&mut self, is_guided: bool);

    /// Radiance expected from this direction at the last event, in that of the pixel; `None` if unknown.
    fn importance(&self, direction: Vec3A) -> Option<f32>;

    /// Shifts a stratified number that is compared with a guided probability.
    fn shift(&mut self, u: f32) -> f32;

    /// Where the path's segments are noted, if they teach.
    fn trail(&mut self) -> Option<&mut Trail>;

    /// Whether the choice on the camera's segment teaches.
    fn learns_choice(&self) -> bool;

    /// The choice that was made on the camera's segment.
    fn remember(&mut self, lesson: Lesson);

    /// Whether lights are sampled at the candidate of the camera's segment, see [`super::decoupled`].
    fn lights_candidates(&self) -> bool;

    /// They were sampled there: the scattering that comes next does not do it again.
    fn mark_lit(&mut self);

    /// Whether that was so, for the first scattering that asks.
    fn take_is_lit(&mut self) -> bool;
}

/// A distribution of directions.
pub(super) trait Directions {
    /// How often a direction is drawn from it, below 1; else the vertex's own is.
    fn share(&self) -> f32;
    /// Density per steradian.
    fn pdf(&self, direction: Vec3A) -> f32;
    /// Draws a direction.
    fn sample(&self, u: Vec2) -> Vec3A;
    /// Tells what it was made of.
    fn record(&self, recorder: &mut Recorder);
}

/// A path that follows [`Guides`] or teaches them.
pub(super) struct Guided<'a> {
    guides: Guides<'a>,
    /// What the field knows about the last vertex asked about: an event, or a point that may be lit.
    asked: Option<&'a Region>,
    /// The same of the last event, until its segment has chosen.
    region: Option<&'a Region>,
    /// Scattering events so far, and those whose directions were guided.
    n_events: u32,
    n_directed: u32,
    shifts: Shifts,
    /// Not a part of the path, which is moved when it is over.
    trail: Option<&'a mut Trail>,
    /// See [`Guidance::lights_candidates`].
    pub(super) lights_candidates: bool,
    /// See [`Guidance::mark_lit`].
    is_lit: bool,
    /// The choice on the camera's segment, until the path's end tells what it was worth.
    pub(super) lesson: Option<Lesson>,
}

impl<'a> Guided<'a> {
    /// `pixel` is the index of the path's pixel.
    pub(super) fn new(guides: Guides<'a>, trail: Option<&'a mut Trail>, seed: u64, pixel: u64) -> Self {
        Self {
            shifts: Shifts::new(seed, pixel, guides.epoch),
            guides,
            asked: None,
            region: None,
            n_events: 0,
            n_directed: 0,
            trail,
            lights_candidates: false,
            is_lit: false,
            lesson: None,
        }
    }
}

/// What the field says about a vertex.
pub(super) struct LearnedDirections {
    mixture: VmfMixture,
    /// How often a direction is drawn from it.
    share: f32,
    /// Training samples behind it.
    n_samples: f32,
}

impl Guidance for Guided<'_> {
    type Directions = LearnedDirections;

    #[inline]
    fn camera(&self) -> Option<SegmentGuide> {
        self.guides.camera
    }

    #[inline]
    fn further(&mut self, direction: Vec3A) -> Option<SegmentGuide> {
        let further = self.guides.further?;
        let region = self.region.take()?;
        further.guide(&region.moments_towards(direction))
    }

    #[inline]
    fn importance(&self, direction: Vec3A) -> Option<f32> {
        let expected = self.guides.camera?.expected();
        let region = self.region.filter(|region| region.n_samples() >= FEWEST_SAMPLES && expected > 0.0)?;
        Some(region.radiance_towards(direction) / expected)
    }

    fn directions(&mut self, vertex: &Vertex<'_>, rng: &mut Pcg) -> Option<LearnedDirections> {
        self.asked = None;
        let field = self.guides.field.filter(|_| self.n_events < GUIDED_EVENTS)?;
        let spread = vertex.spread();
        if spread == Spread::Narrow {
            return None;
        }
        let position = vertex.position();
        let region = field.region(position, vertex.class(), rng.next_f32())?;
        self.asked = Some(region);
        if !self.guides.directs || self.n_directed >= DIRECTED_EVENTS {
            return None;
        }
        let (mixture, share) = match vertex {
            Vertex::Medium { travel, phase, .. } => {
                region.narrower_than_hg(position, -*travel, phase.mean_cosine())
            }
            Vertex::Surface { frame, wo, .. } if spread == Spread::Reflection => {
                let normal = frame.frame.normal;
                region.narrower_than_cosine(position, if wo.dot(normal) < 0.0 { -normal } else { normal })
            }
            Vertex::Surface { .. } => (region.incident(position).mixture().clone(), MAX_SHARE),
        };
        (share > MIN_SHARE).then(|| LearnedDirections {
            mixture,
            share: share.min(MAX_SHARE),
            n_samples: region.n_samples(),
        })
    }

    #[inline]
    fn count_event(&mut self, is_guided: bool) {
        self.region = self.asked.take();
        self.n_events += 1;
        self.n_directed += u32::from(is_guided);
    }

    #[inline]
    fn shift(&mut self, u: f32) -> f32 {
        self.shifts.apply(u)
    }

    #[inline]
    fn trail(&mut self) -> Option<&mut Trail> {
        self.trail.as_deref_mut()
    }

    #[inline]
    fn learns_choice(&self) -> bool {
        self.guides.learns_choice
    }

    fn remember(&mut self, lesson: Lesson) {
        self.lesson = Some(lesson);
    }

    #[inline]
    fn lights_candidates(&self) -> bool {
        self.lights_candidates
    }

    #[inline]
    fn mark_lit(&mut self) {
        self.is_lit = true;
    }

    #[inline]
    fn take_is_lit(&mut self) -> bool {
        std::mem::take(&mut self.is_lit)
    }
}

impl Directions for LearnedDirections {
    #[inline]
    fn share(&self) -> f32 {
        self.share
    }

    #[inline]
    fn pdf(&self, direction: Vec3A) -> f32 {
        self.mixture.pdf(direction)
    }

    #[inline]
    fn sample(&self, u: Vec2) -> Vec3A {
        self.mixture.sample(u).direction
    }

    #[inline]
    fn record(&self, recorder: &mut Recorder) {
        recorder.guide(self.n_samples, self.mixture.len());
    }
}
