//! What the learned depends on, and what is left of it after a change.

use super::Cache;
use super::error::Result;
use super::words::{Reader, Writer};
use crate::image_space::{ImageGuide, View};

/// What a changed scene keeps of the samples it learned from: as much as a region keeps of the one it was cut from.
const KEPT: f32 = 0.25;

/// A part of what light depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Shapes and where they are, and where lights are.
    Geometry,
    /// Volumes and their fields.
    Media,
    /// Materials.
    Materials,
    /// Lights.
    Lights,
    /// The camera and the image's size.
    Camera,
    /// What decides which light is followed.
    Integrator,
}

impl Section {
    /// Every section, in the order of a file.
    pub const ALL: [Self; 6] =
        [Self::Geometry, Self::Media, Self::Materials, Self::Lights, Self::Camera, Self::Integrator];

    /// Whether a change makes what was learned wrong, instead of doubtful.
    pub(super) fn invalidates(self) -> bool {
        matches!(self, Self::Lights | Self::Materials | Self::Integrator)
    }

    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Geometry => "geometry",
            Self::Media => "media",
            Self::Materials => "materials",
            Self::Lights => "lights",
            Self::Camera => "camera",
            Self::Integrator => "integrator settings",
        }
    }
}

/// A hash of each section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Fingerprint([[u8; 16]; Section::ALL.len()]);

impl Fingerprint {
    /// From the hash of each section.
    pub fn new(hash: impl FnMut(Section) -> [u8; 16]) -> Self {
        Self(Section::ALL.map(hash))
    }

    /// The hash of a section.
    pub fn of(&self, section: Section) -> [u8; 16] {
        self.0[section as usize]
    }

    /// The sections that differ.
    pub fn changes(&self, other: &Self) -> Vec<Section> {
        Section::ALL.into_iter().filter(|&section| self.of(section) != other.of(section)).collect()
    }

    pub(super) fn write(&self, out: &mut Writer) {
        self.0.iter().for_each(|hash| out.bytes(hash));
    }

    pub(super) fn read(input: &mut Reader<'_>) -> Result<Self> {
        let mut hashes = Self::default();
        for hash in &mut hashes.0 {
            *hash = input.array()?;
        }
        Ok(hashes)
    }
}

/// The scene that a cache is wanted for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Present {
    /// What it is made of.
    pub fingerprint: Fingerprint,
    /// The stage's point that is the origin of its space.
    pub origin: [f64; 3],
    /// Its camera.
    pub view: View,
    /// Pixels across and down.
    pub resolution: [usize; 2],
}

/// What is left of a cache in a scene that may have changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reuse {
    /// The sections that differ.
    pub changes: Vec<Section>,
    /// Whether the field is used.
    pub field: bool,
    /// Whether the image guide is used.
    pub image: bool,
}

impl Cache {
    /// Makes this what the scene `now` can use.
    ///
    /// Light that changed, and surfaces and media that reflect it differently, make what was learned wrong: it is dropped.
    /// Where only the place of things changed, most of it is still right: it is kept, but counts for a quarter of its
    /// samples. An image guide is of one camera; what it knows is moved to where the other one sees it.
    ///
    /// Lamps that moved are doubted, not dropped. Variance of the first 16 samples, warm over cold, behind a shade in a foggy
    /// room four units wide (24 x 16 pixels, 96 seeds; taught by 128 samples): of a sphere light .93 after a step of 0.05,
    /// 1.0 of 0.2, 1.15 of 1; of a glowing sphere, which no light sampling finds, .56, .66 and 1.1. Lamps of animated
    /// shots take small steps; one that jumps costs noise.
    pub fn reuse(&mut self, now: &Present) -> Reuse {
        let changes = now.fingerprint.changes(&self.fingerprint);
        let is_wrong = changes.iter().any(|section| section.invalidates());
        self.field = self.field.take().filter(|_| !is_wrong);
        self.image = self.image.take().filter(|_| !is_wrong);
        if changes.contains(&Section::Camera) {
            let seen = |image: ImageGuide| image.reprojected(&self.view, &now.view, now.resolution);
            self.image = self.image.take().map(seen);
        }
        self.view = now.view;
        self.move_to(now.origin);
        if !changes.is_empty() {
            self.field.iter_mut().for_each(|field| field.decay(KEPT));
            self.image.iter_mut().for_each(|image| image.decay(KEPT));
            self.samples = 0;
        }
        if self.field.is_none() && self.image.is_none() {
            self.frames.clear();
            self.samples = 0;
        }
        self.image.iter_mut().for_each(ImageGuide::make_odds);
        self.fingerprint = now.fingerprint;
        Reuse { field: self.field.is_some(), image: self.image.is_some(), changes }
    }

    /// Moves the field to another origin of its space; one that is out of reach of f32 is dropped.
    pub(super) fn move_to(&mut self, origin: [f64; 3]) {
        let offset = std::array::from_fn(|i| (self.origin[i] - origin[i]) as f32);
        self.field = self.field.take().filter(|_| offset.iter().all(|v: &f32| v.is_finite()));
        if let Some(field) = self.field.as_mut().filter(|_| offset != [0.0; 3]) {
            field.translate(offset);
        }
        self.origin = origin;
    }
}
