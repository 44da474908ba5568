//! Piecewise constant bounds of a grid's density along a ray.
//!
//! A digital differential analyser visits the brick cells of a [`BrickGrid`] in order (Amanatides & Woo 1987) and skips
//! the empty ones. Where a brick is optically thick under its majorant it visits single voxel cells instead, bounded by
//! their eight corners: one bright voxel then costs only the rays that meet it.

use crate::grid::{BrickGrid, GridCell};
use crate::medium::GridDensity;
use glam::{BVec3A, IVec3, Vec3A};
use tyndall_math::Ray;

/// A cell is split into voxel cells if more candidates than this are expected in it.
const REFINE_ABOVE: f32 = 16.0;

/// Two per brick along an axis.
const EMISSION_CANDIDATES_PER_VOXEL: f32 = 0.25;

/// A piece of the ray inside one cell.
#[derive(Debug, Clone, Copy)]
pub struct GridStep {
    /// Where the piece begins.
    pub t0: f32,
    /// Where it ends, greater than `t0`.
    pub t1: f32,
    /// Upper bound of density on it, positive.
    pub max: f32,
    /// Lower bound of density on it.
    pub min: f32,
    cell: GridCell,
}

/// Visits the non-empty cells of a grid along a ray, in order.
#[derive(Debug, Clone)]
pub struct GridWalk<'a> {
    grid: &'a BrickGrid,
    origin: Vec3A,
    direction: Vec3A,
    inverse: Vec3A,
    /// Axes along which the ray moves, and along which it moves up.
    moves: BVec3A,
    moves_up: BVec3A,
    t: f32,
    t_end: f32,
    voxel: IVec3,
    lowest: IVec3,
    highest: IVec3,
    /// The cell being crossed voxel by voxel.
    refined: Option<GridCell>,
    coefficient: f32,
}

impl<'a> GridWalk<'a> {
    /// The walk over `[t0, t1]` of a world ray. `coefficient` is the extinction at density 1, which decides where
    /// voxels are visited instead of bricks.
    pub fn new(density: &'a GridDensity, ray: &Ray, [t0, t1]: [f32; 2], coefficient: f32) -> Self {
        let grid = &*density.grid;
        let origin = density.index_from_world.transform_point3a(ray.origin);
        let direction = density.index_from_world.transform_vector3a(ray.direction);
        let moves = direction.cmpne(Vec3A::ZERO);
        let mut walk = Self {
            grid,
            origin,
            direction,
            inverse: Vec3A::select(moves, direction.recip(), Vec3A::ZERO),
            moves,
            moves_up: direction.cmpgt(Vec3A::ZERO),
            t: t0,
            t_end: t1,
            voxel: IVec3::ZERO,
            lowest: IVec3::ZERO,
            highest: IVec3::ZERO,
            refined: None,
            coefficient,
        };
        walk.enter();
        walk
    }

    /// Least rate of candidates, per unit of `t`, that meets the light of a grid whatever its extinction: flames may
    /// have none.
    pub fn emission_rate(&self) -> f32 {
        let rate = EMISSION_CANDIDATES_PER_VOXEL * self.direction.length();
        if rate.is_finite() { rate.max(f32::MIN_POSITIVE) } else { 0.0 }
    }

    /// Density at `t` inside `step`; never outside its bounds.
    #[inline]
    pub fn density(&self, step: &GridStep, t: f32) -> f32 {
        self.grid.density_in(&step.cell, self.origin + self.direction * t)
    }

    /// Clips the walk to the active box and finds the first cell.
    fn enter(&mut self) {
        let (Some([lo, hi]), Some([box_lo, box_hi])) = (self.grid.active_cells(), self.grid.bounds()) else {
            self.t_end = self.t;
            return;
        };
        let (a, b) = ((box_lo - self.origin) * self.inverse, (box_hi - self.origin) * self.inverse);
        let infinity = Vec3A::splat(f32::INFINITY);
        let (near, far) = (a.min(b), a.max(b));
        let near = Vec3A::select(self.moves, near, -infinity).max_element();
        let far = Vec3A::select(self.moves, far, infinity).min_element();
        let beside = self.origin.cmplt(box_lo) | self.origin.cmpgt(box_hi);
        (self.t, self.t_end) = (self.t.max(near), self.t_end.min(far));
        if (beside & !self.moves).any() || !(self.t < self.t_end) {
            self.t_end = self.t;
        }
        (self.lowest, self.highest) = (lo, hi);
        let p = self.origin + self.direction * self.t;
        self.voxel = p.floor().as_ivec3().clamp(lo, hi);
    }

    /// Where the ray leaves `cell`.
    #[inline]
    fn exit(&self, cell: &GridCell) -> Vec3A {
        let lo = cell.lo.as_vec3a();
        let face = Vec3A::select(self.moves_up, lo + cell.edge as f32, lo);
        let t = (face - self.origin) * self.inverse;
        Vec3A::select(self.moves, t, Vec3A::splat(f32::INFINITY))
    }

    /// Moves to the first voxel behind `cell`, which the ray leaves at `t`, through the face of the nearest `exit`.
    #[inline]
    fn leave(&mut self, cell: &GridCell, exit: Vec3A, t: f32) {
        let p = self.origin + self.direction * t;
        let last = cell.lo + (cell.edge - 1);
        let mut voxel = p.floor().as_ivec3().clamp(cell.lo, last);
        let axis = exit.min_position();
        voxel[axis] = if self.direction[axis] > 0.0 { last[axis] + 1 } else { cell.lo[axis] - 1 };
        self.voxel = voxel;
    }

    #[inline]
    fn cell(&mut self) -> GridCell {
        if let Some(parent) = &self.refined {
            if parent.contains(self.voxel) {
                return self.grid.voxel_cell(self.voxel, parent);
            }
            self.refined = None;
        }
        self.grid.cell(self.voxel)
    }
}

impl Iterator for GridWalk<'_> {
    type Item = GridStep;

    /// The next piece with positive majorant.
    #[inline]
    fn next(&mut self) -> Option<GridStep> {
        while self.t < self.t_end {
            let cell = self.cell();
            let exit = self.exit(&cell);
            let (t0, t1) = (self.t, exit.min_element().max(self.t).min(self.t_end));
            if cell.edge > 1 && cell.max * self.coefficient * (t1 - t0) > REFINE_ABOVE && cell.min < cell.max {
                self.refined = Some(cell);
                continue;
            }
            self.leave(&cell, exit, t1);
            self.t = t1;
            let inside = self.voxel.cmpge(self.lowest).all() && self.voxel.cmple(self.highest).all();
            if !inside {
                self.t_end = t1;
            }
            if cell.max > 0.0 && t1 > t0 {
                return Some(GridStep { t0, t1, max: cell.max, min: cell.min, cell });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests;
