//! A field as bytes and back, bit for bit.
//!
//! Lobes that a region does not have are not stored. What is read back obeys what all code here relies on, or is refused:
//! every leaf names a region of its own, children come after their parents, numbers are finite.

use super::tree::{Node, Tree};
use super::{Field, FieldSettings, Region, Totals};
use crate::cache::{CacheError, Unpacking, Writer, checked_count};
use crate::directional::{LobeSums, MAX_CONCENTRATION, MAX_LOBES, PerLobe, SufficientStatistics, VmfMixture};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// More regions than any field of ours has: 0.2 GB.
const MOST_REGIONS: usize = 1 << 18;
const MOST_DEPTH: u32 = 32;
const SETTINGS_BYTES: usize = 6 * 4 + 3 * 8;
const NODE_BYTES: usize = 8;
/// Words of a region before those of its lobes: lobes, depth, samples, pivot, spread, sums over all lobes.
const FIXED_WORDS: usize = 3 + 3 + 3 + 3;
const MOMENT_ROWS: usize = 9;
/// Words of each lobe: mixture, distance, statistics, odds.
const LOBE_WORDS: usize = 5 + 1 + SufficientStatistics::ROWS + MOMENT_ROWS;
/// Words of the largest record.
const MOST_WORDS: usize = record_words(MAX_LOBES);
/// How far sums of weights and lengths of means may be off 1.
const ROUNDING: f32 = 1e-3;

type Result<T> = std::result::Result<T, CacheError>;

impl Field {
    pub(crate) fn write(&self, out: &mut Writer) {
        let s = &self.settings;
        let settings = [
            s.region_samples,
            s.effective_samples,
            s.max_depth,
            s.initial_lobes,
            s.max_lobes,
            s.max_iterations,
        ];
        settings.into_iter().for_each(|v| out.u32(v));
        out.u64(self.statistics.n_samples);
        out.u64(self.statistics.n_rejected);
        out.u64(self.statistics.n_updates.into());
        for tree in [&self.surface, &self.volume] {
            write_tree(tree, out);
        }
    }

    pub(crate) fn read(mut section: Unpacking<'_>) -> Result<Self> {
        let mut input = section.take(SETTINGS_BYTES)?;
        let [region_samples, effective_samples, max_depth, initial_lobes, max_lobes, max_iterations] =
            [input.u32()?, input.u32()?, input.u32()?, input.u32()?, input.u32()?, input.u32()?];
        let settings = FieldSettings {
            region_samples,
            effective_samples,
            max_depth,
            initial_lobes,
            max_lobes,
            max_iterations,
        };
        if settings.sane() != settings {
            return Err(CacheError::Malformed("a setting of its field is out of range"));
        }
        let mut count = || checked_count(input.u64()?);
        let (n_samples, n_rejected, n_updates) = (count()?, count()?, count()?);
        let statistics = Totals { n_samples, n_rejected, n_updates: n_updates.min(1 << 31) as u32 };
        let (surface, volume) = (read_tree(&mut section)?, read_tree(&mut section)?);
        section.finish()?;
        Ok(Self { settings, surface, volume, statistics })
    }
}

fn write_tree(tree: &Tree, out: &mut Writer) {
    out.u32(tree.nodes.len() as u32);
    out.u32(tree.regions.len() as u32);
    for node in &tree.nodes {
        out.f32(node.plane);
        out.u32(node.link);
    }
    tree.regions.iter().for_each(|region| write_region(region, out));
}

fn read_tree(section: &mut Unpacking<'_>) -> Result<Tree> {
    let mut counts = section.take(8)?;
    let (n_nodes, n_regions) = (counts.u32()? as usize, counts.u32()? as usize);
    if n_regions > MOST_REGIONS {
        return Err(CacheError::Malformed("its field has too many regions"));
    }
    let nodes = read_nodes(section.take(n_nodes * NODE_BYTES)?.rest());
    check_links(&nodes, n_regions)?;
    Ok(Tree { nodes, regions: read_regions(section, n_regions)? })
}

fn read_nodes(bytes: &[u8]) -> Vec<Node> {
    let (words, _) = bytes.as_chunks::<4>().0.as_chunks::<2>();
    let node = |[plane, link]: &[[u8; 4]; 2]| Node {
        plane: f32::from_le_bytes(*plane),
        link: u32::from_le_bytes(*link),
    };
    words.iter().map(node).collect()
}

/// Regions are read in parallel, as many at a time as are unpacked, right to where they stay.
fn read_regions(section: &mut Unpacking<'_>, n: usize) -> Result<Vec<Region>> {
    if n > section.left() / (4 * record_words(1)) {
        return Err(CacheError::Malformed("its field announces more regions than it holds"));
    }
    let mut regions = Vec::with_capacity(n);
    let is_strange = AtomicBool::new(false);
    while regions.len() < n {
        let bytes = section.peek(4 * MOST_WORDS)?;
        let records = whole_records(bytes, n - regions.len())?;
        let read = |record: &&[u8]| {
            let region = read_region(record);
            // While it is at hand: all regions together are more than caches of processors hold.
            if !is_sane(&region) {
                is_strange.store(true, Ordering::Relaxed);
            }
            region
        };
        regions.par_extend(records.par_iter().map(read));
        let n_bytes = records.iter().map(|record| record.len()).sum();
        section.skip(n_bytes);
    }
    if is_strange.into_inner() {
        Err(CacheError::Malformed("a region of its field holds numbers that make no sense"))
    } else {
        Ok(regions)
    }
}

/// Every node but the first has one parent, before it; every region one leaf.
fn check_links(nodes: &[Node], n_regions: usize) -> Result<()> {
    let (mut has_parent, mut has_leaf) = (vec![false; nodes.len()], vec![false; n_regions]);
    if let Some(root) = has_parent.first_mut() {
        *root = true;
    }
    let mut claim = |i: usize, node: &Node| match (node.children(), node.region()) {
        (Some((_, plane, below)), _) => {
            let pair = has_parent.get_mut(below..below + 2).filter(|_| below > i && plane.is_finite());
            pair.is_some_and(|pair| pair.iter_mut().all(|claimed| !std::mem::replace(claimed, true)))
        }
        (None, Some(region)) => {
            has_leaf.get_mut(region).is_some_and(|claimed| !std::mem::replace(claimed, true))
        }
        (None, None) => false,
    };
    let is_tree = nodes.iter().enumerate().all(|(i, node)| claim(i, node));
    if is_tree && has_parent.iter().chain(&has_leaf).all(|&claimed| claimed) {
        Ok(())
    } else {
        Err(CacheError::Malformed("the planes of its field form no tree"))
    }
}

fn write_region(region: &Region, out: &mut Writer) {
    let n = region.mixture.len();
    let (statistics, totals) = region.statistics.parts();
    out.u32(n as u32);
    out.u32(region.depth);
    out.f32(region.n_samples);
    out.f32s(region.pivot.into_iter().chain(region.spread).chain(totals));
    let rows = region.mixture.rows().into_iter().chain([&region.inverse_distance]);
    for row in rows.chain(statistics).chain(&region.moments.0) {
        out.f32s(row.first(n));
    }
}

/// Words of the record of a region of `n` lobes.
const fn record_words(n: usize) -> usize {
    FIXED_WORDS + LOBE_WORDS * n
}

/// The first records in `bytes`, one at least and `most` at most.
fn whole_records(bytes: &[u8], most: usize) -> Result<Vec<&[u8]>> {
    let (mut records, mut rest) = (Vec::new(), bytes);
    while records.len() < most
        && let Some((n_lobes, _)) = rest.split_first_chunk()
    {
        let n_lobes = u32::from_le_bytes(*n_lobes) as usize;
        if !(1..=MAX_LOBES).contains(&n_lobes) {
            return Err(CacheError::Malformed("a region of its field has no lobes or too many"));
        }
        let Some((record, after)) = rest.split_at_checked(4 * record_words(n_lobes)) else { break };
        records.push(record);
        rest = after;
    }
    if records.is_empty() {
        Err(CacheError::Malformed("its field ends within a region"))
    } else {
        Ok(records)
    }
}

/// `record` is of [`whole_records`].
fn read_region(record: &[u8]) -> Region {
    // Rows are read with what follows them; behind the last one there is room for that.
    let mut words = [0u32; MOST_WORDS + MAX_LOBES];
    words
        .iter_mut()
        .zip(record.as_chunks::<4>().0)
        .for_each(|(word, bytes)| *word = u32::from_le_bytes(*bytes));
    let n = words[0] as usize;
    let row = |i: usize| {
        let row: [f32; MAX_LOBES] = floats(&words[FIXED_WORDS + i * n..]);
        PerLobe::from_array(std::array::from_fn(|k| if k < n { row[k] } else { 0.0 }))
    };
    let rows_from = |first: usize| move |i: usize| row(first + i);
    let statistics = std::array::from_fn(rows_from(6));
    Region {
        depth: words[1],
        n_samples: f32::from_bits(words[2]),
        pivot: floats(&words[3..]),
        spread: floats(&words[6..]),
        mixture: VmfMixture::from_rows(n, std::array::from_fn(row)),
        inverse_distance: row(5),
        statistics: SufficientStatistics::from_parts(statistics, floats(&words[9..])),
        moments: LobeSums(std::array::from_fn(rows_from(6 + SufficientStatistics::ROWS))),
    }
}

/// The first numbers of `words`, as many as there must be.
#[inline(always)]
fn floats<const N: usize>(words: &[u32]) -> [f32; N] {
    let words = &words[..N];
    std::array::from_fn(|k| f32::from_bits(words[k]))
}

/// What training keeps true of a region, so that densities are finite and sampling follows them.
fn is_sane(region: &Region) -> bool {
    let n = region.mixture.len();
    let rows = region.mixture.rows();
    let [weight, kappa, x, y, z] = rows;
    let (sums, [log_likelihood, total_weight, n_samples]) = region.statistics.parts();
    let (moments, distance) = (&region.moments.0, &region.inverse_distance);
    let totals = region.spread.into_iter().chain([total_weight, n_samples, region.n_samples]);
    let is_lobe = |k: usize| {
        let length = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
        weight[k] > 0.0 && kappa[k] <= MAX_CONCENTRATION && (length - 1.0).abs() < ROUNDING
    };
    region.depth <= MOST_DEPTH
        && region.pivot.into_iter().chain([log_likelihood]).all(f32::is_finite)
        && totals.into_iter().all(|v| v.is_finite() && v >= 0.0)
        && PerLobe::are_finite(rows.into_iter().chain(sums).chain(moments).chain([distance]))
        && PerLobe::are_nonnegative(moments.iter().chain([kappa, distance, &sums[0], &sums[1]]))
        && (0..n).all(is_lobe)
        && (weight.total() - 1.0).abs() < f64::from(ROUNDING)
}
