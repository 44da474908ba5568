//! What goes into a grid, and what was wrong with it.

/// A sparse grid as its file describes it, borrowed: of scalars, or of colours `[f32; 3]`.
#[derive(Debug, Clone, Default)]
pub struct SparseVoxels<'a, T = f32> {
    /// Origin (a multiple of 8) and the 512 values of each leaf, offset x << 6 | y << 3 | z. Inactive voxels hold the
    /// value they should be read as, normally 0.
    pub leaves: Vec<([i32; 3], &'a [T])>,
    /// Origin, edge in voxels (8, 128 or 4096; any multiple of 8 works) and value of each active tile.
    pub tiles: Vec<([i32; 3], u32, T)>,
    /// Value outside; read as 0, and reported if it is not.
    pub background: T,
}

/// How a stored value becomes a density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Reading {
    /// It is one.
    Density,
    /// It is a signed distance. Density is 1 inside and falls to 0 across the surface, linearly over one voxel: the
    /// part of a voxel that is inside, for a flat surface along the axes.
    Interior {
        /// 1 / voxel size, in the distance's unit.
        per_voxel: f32,
    },
}

/// What the build found. Counts are voxels (of colours, components), a tile counting once.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GridReport {
    /// NaN values, read as 0.
    pub nan_count: u64,
    /// Infinite values, read as 0.
    pub inf_count: u64,
    /// Negative values, read as 0.
    pub negative_count: u64,
    /// Values above [`super::MAX_DENSITY`], cut.
    pub huge_count: u64,
    /// Leaves and tiles dropped: beyond ±2^30, origin or size not a multiple of 8, or leaf not of 512 values.
    pub dropped_count: u64,
    /// The background was not 0; outside reads 0 all the same.
    pub nonzero_background: bool,
    /// Bricks with values of their own.
    pub brick_count: u64,
    /// The box is mostly empty: hash maps instead of a flat table.
    pub is_sparse: bool,
}

impl GridReport {
    /// The density that `value` stands for, counting what is no number.
    #[inline]
    pub(super) fn read(&mut self, reading: Reading, value: f32) -> f32 {
        match reading {
            Reading::Density => self.clean(value),
            Reading::Interior { .. } if value.is_nan() => {
                self.nan_count += 1;
                0.0
            }
            Reading::Interior { per_voxel } => (0.5 - value * per_voxel).clamp(0.0, 1.0),
        }
    }

    /// The value to store for `value`, counting what is changed.
    #[inline]
    pub(super) fn clean(&mut self, value: f32) -> f32 {
        if (0.0..=super::MAX_DENSITY).contains(&value) {
            return value;
        }
        self.clean_odd(value)
    }

    #[cold]
    fn clean_odd(&mut self, value: f32) -> f32 {
        let (count, replacement) = match value {
            v if v.is_nan() => (&mut self.nan_count, 0.0),
            v if v.is_infinite() => (&mut self.inf_count, 0.0),
            v if v < 0.0 => (&mut self.negative_count, 0.0),
            _ => (&mut self.huge_count, super::MAX_DENSITY),
        };
        *count += 1;
        replacement
    }

    /// Adds the counts of another part of the same grid.
    pub(super) fn merge(mut self, other: Self) -> Self {
        self.nan_count += other.nan_count;
        self.inf_count += other.inf_count;
        self.negative_count += other.negative_count;
        self.huge_count += other.huge_count;
        self.dropped_count += other.dropped_count;
        self
    }
}
