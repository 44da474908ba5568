//! Prims that move while the shutter is open.
//!
//! Between two keys, the matrices of objects and instances are interpolated linearly: whoever turns one gives as many keys
//! as the arc needs. Cameras go straight and turn evenly.

use glam::DAffine3;
use serde::Serialize;

/// Where a moving prim is at some moment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TransformKey {
    /// In [0, 1]: 0 when the shutter opens, 1 when it closes.
    pub time: f64,
    /// Places the object; for instanced prims relative to the instance. Of cameras, scale is ignored.
    pub world_from_object: DAffine3,
}

/// Where the instances of a moving instancer are at some moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstancerKey {
    /// As of [`TransformKey`].
    pub time: f64,
    /// As many as the instancer has, in the same order.
    pub transforms: Vec<DAffine3>,
}
