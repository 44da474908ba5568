//! An orthonormal basis around a direction.

use glam::Vec3A;

/// A right-handed orthonormal basis; `normal` is the local z axis.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Local x axis in world space.
    pub tangent: Vec3A,
    /// Local y axis in world space.
    pub bitangent: Vec3A,
    /// Local z axis in world space.
    pub normal: Vec3A,
}

impl Frame {
    /// The basis whose z axis is the unit vector `normal`, without a branch or a singular direction
    /// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1)).
    #[inline]
    pub fn from_normal(normal: Vec3A) -> Self {
        let sign = 1f32.copysign(normal.z);
        let a = -1.0 / (sign + normal.z);
        let b = normal.x * normal.y * a;
        Self {
            tangent: Vec3A::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
            bitangent: Vec3A::new(b, sign + normal.y * normal.y * a, -normal.y),
            normal,
        }
    }

    /// A local vector expressed in world space.
    #[inline]
    pub fn world_from_local(&self, v: Vec3A) -> Vec3A {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }

    /// A world vector expressed in this basis.
    #[inline]
    pub fn local_from_world(&self, v: Vec3A) -> Vec3A {
        Vec3A::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn is_orthonormal_and_right_handed(x in -1f32..1.0, y in -1f32..1.0, z in -1f32..1.0) {
            let v = Vec3A::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            let f = Frame::from_normal(v.normalize());
            prop_assert!((f.tangent.length() - 1.0).abs() < 1e-5);
            prop_assert!(f.tangent.dot(f.bitangent).abs() < 1e-5);
            prop_assert!((f.tangent.cross(f.bitangent) - f.normal).length() < 1e-5);
            let w = Vec3A::new(0.3, -0.2, 0.9);
            prop_assert!((f.local_from_world(f.world_from_local(w)) - w).length() < 1e-5);
        }
    }

    #[test]
    fn poles_are_not_singular() {
        for z in [1.0, -1.0] {
            let f = Frame::from_normal(Vec3A::new(0.0, 0.0, z));
            assert!(f.tangent.is_finite() && f.bitangent.is_finite());
        }
    }
}
