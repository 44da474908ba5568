//! Many placements of the same prims.

use super::InstancerKey;
use crate::PrimPath;
use glam::DAffine3;
use serde::Serialize;

/// Placements. Prims that name this instancer are drawn once per entry of `transforms`, at
/// `instances of parent * transforms[i] * prim.world_from_object`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Instancer {
    /// One placement an instance, `parent_from_instance` (the world if there is no parent).
    pub transforms: Vec<DAffine3>,
    /// Where they are while the shutter is open, in the order of time; fewer than two if they stand still.
    pub motion: Vec<InstancerKey>,
    /// The instancer this one is itself a prototype of.
    pub parent: Option<PrimPath>,
    /// Shown or hidden, with all instances.
    pub visible: bool,
}
