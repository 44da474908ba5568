//! Caches that have become too large.

use super::Cache;

/// Regions below which a field is not made smaller.
const FEWEST_REGIONS: usize = 2;
/// What is aimed at, relative to the limit: sizes of regions differ.
const AIM: f64 = 0.95;

impl Cache {
    /// Makes a file of no more than `most` bytes: without the image guide if there must be one less, then with fewer regions
    /// of the field. Says whether that was possible; if not, the smallest there is remains.
    pub fn shrink_to(&mut self, most: usize) -> bool {
        let mut size = self.to_bytes().len();
        if size > most && self.image.take().is_some() {
            size = self.to_bytes().len();
        }
        while size > most {
            let Some(field) = &mut self.field else { return false };
            let before = field.statistics();
            let regions = before.n_surface_regions + before.n_volume_regions;
            if regions <= FEWEST_REGIONS {
                return false;
            }
            field.coarsen((AIM * regions as f64 * most as f64 / size as f64) as usize);
            size = self.to_bytes().len();
        }
        true
    }
}
