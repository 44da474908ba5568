//! Light transport: committed world, path loop, direct light, film and AOVs, sessions.
//!
//! [`World::build`] makes a scene ready for rays, [`Session`] renders it into a [`Film`]. Opens no file (content comes
//! through [`tyndall_scene::AssetLoader`]) and reads no clock: time limits and progress belong to the caller.

pub mod aov;
mod camera;
mod film;
mod filter;
mod guide;
mod path;
mod session;
mod world;

pub use camera::{CameraModel, CameraRay};
pub use film::{Film, SAMPLE_GRID, SavedFilm, StateError, TILE_SIZE};
pub use guide::{Arm, ArmResult, FieldSize, GuideState, GuideStatistics, TrialResult};
pub use path::PathStatistics;
pub use session::{Control, Session, SessionError, Snapshot};
pub use world::{World, WorldCache, WorldError, WorldSummary};
