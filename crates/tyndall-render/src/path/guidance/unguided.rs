//! No guide: nothing of it is left in the compiled loop.

use super::{Directions, Guidance};
use crate::path::lesson::Lesson;
use crate::path::record::Recorder;
use crate::path::training::Trail;
use crate::path::vertex::Vertex;
use glam::{Vec2, Vec3A};
use std::convert::Infallible;
use tyndall_guiding::SegmentGuide;
use tyndall_math::random::Pcg;

/// Nothing guides the path, and it teaches nothing.
pub(in crate::path) struct Unguided;

impl Guidance for Unguided {
    type Directions = Infallible;

    #[inline]
    fn camera(&self) -> Option<SegmentGuide> {
        None
    }

    #[inline]
    fn further(&mut self, _: Vec3A) -> Option<SegmentGuide> {
        None
    }

    #[inline]
    fn importance(&self, _: Vec3A) -> Option<f32> {
        None
    }

    #[inline]
    fn directions(&mut self, _: &Vertex<'_>, _: &mut Pcg) -> Option<Infallible> {
        None
    }

    #[inline]
    fn count_event(&mut self, _: bool) {}

    #[inline]
    fn shift(&mut self, u: f32) -> f32 {
        u
    }

    #[inline]
    fn trail(&mut self) -> Option<&mut Trail> {
        None
    }

    #[inline]
    fn learns_choice(&self) -> bool {
        false
    }

    #[inline]
    fn remember(&mut self, _: Lesson) {}

    #[inline]
    fn lights_candidates(&self) -> bool {
        false
    }

    #[inline]
    fn mark_lit(&mut self) {}

    #[inline]
    fn take_is_lit(&mut self) -> bool {
        false
    }
}

impl Directions for Infallible {
    fn share(&self) -> f32 {
        match *self {}
    }

    fn pdf(&self, _: Vec3A) -> f32 {
        match *self {}
    }

    fn sample(&self, _: Vec2) -> Vec3A {
        match *self {}
    }

    fn record(&self, _: &mut Recorder) {
        match *self {}
    }
}
