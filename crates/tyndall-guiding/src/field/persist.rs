//! A field as bytes and back, bit for bit.
//!
//! Lobes that a region does not have are not stored. What is read back obeys what all code here relies on, or is refused:
//! every leaf names a region of its own, children come after their parents, numbers are finite.

use super::tree::{Node, Tree};
use super::{Field, FieldSettings, Region, Totals};
use crate::cache::{CacheError, Reader, Writer, checked_count, f32s_of};
use crate::directional::{LobeSums, MAX_CONCENTRATION, MAX_LOBES, PerLobe, SufficientStatistics, VmfMixture};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// More regions than any field of ours has: 0.8 GB.
const MOST_REGIONS: u32 = 1 << 18;
const MOST_DEPTH: u32 = 32;
const NODE_BYTES: usize = 8;
/// Words of a region before those of its lobes: lobes, depth, samples, pivot, spread, sums over all lobes.
const FIXED_WORDS: usize = 3 + 3 + 3 + 3;
const MOMENT_ROWS: usize = 9;
/// Words of each lobe: mixture, distance, statistics, odds.
const LOBE_WORDS: usize = 5 + 1 + SufficientStatistics::ROWS + MOMENT_ROWS;
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

    pub(crate) fn read(input: &mut Reader<'_>) -> Result<Self> {
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
        let (surface, volume) = (read_tree(input)?, read_tree(input)?);
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

fn read_tree(input: &mut Reader<'_>) -> Result<Tree> {
    let (n_nodes, n_regions) = (input.u32()?, input.u32()?);
    if n_regions > MOST_REGIONS {
        return Err(CacheError::Malformed("its field has too many regions"));
    }
    let words = input.items(n_nodes, NODE_BYTES)?.as_chunks::<4>().0;
    let (words, _) = words.as_chunks::<2>();
    let node = |[plane, link]: &[[u8; 4]; 2]| Node {
        plane: f32::from_le_bytes(*plane),
        link: u32::from_le_bytes(*link),
    };
    let nodes: Vec<Node> = words.iter().map(node).collect();
    check_links(&nodes, n_regions as usize)?;
    let mut records = Vec::new();
    for _ in 0..n_regions {
        records.push(next_record(input)?);
    }
    let is_strange = AtomicBool::new(false);
    let read = |record: &[u8]| {
        let region = read_region(record);
        // While it is at hand: all regions together are more than caches of processors hold.
        if !is_sane(&region) {
            is_strange.store(true, Ordering::Relaxed);
        }
        region
    };
    let regions = records.into_par_iter().map(read).collect();
    if is_strange.into_inner() {
        Err(CacheError::Malformed("a region of its field holds numbers that make no sense"))
    } else {
        Ok(Tree { nodes, regions })
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

/// The bytes of the next region, as many as its number of lobes asks for.
fn next_record<'a>(input: &mut Reader<'a>) -> Result<&'a [u8]> {
    let n_lobes = input.clone().u32()?;
    if !(1..=MAX_LOBES as u32).contains(&n_lobes) {
        return Err(CacheError::Malformed("a region of its field has no lobes or too many"));
    }
    input.bytes(4 * (FIXED_WORDS + LOBE_WORDS * n_lobes as usize))
}

/// `record` is of [`next_record`].
fn read_region(record: &[u8]) -> Region {
    let word = |i: usize| u32::from_le_bytes(std::array::from_fn(|k| record[4 * i + k]));
    let vector = |i: usize| std::array::from_fn(|k| f32::from_bits(word(i + k)));
    let n = word(0) as usize;
    let mut rows = record[4 * FIXED_WORDS..].chunks_exact(4 * n);
    let mut row = || PerLobe::from_first(rows.next().into_iter().flat_map(f32s_of));
    Region {
        depth: word(1),
        n_samples: f32::from_bits(word(2)),
        pivot: vector(3),
        spread: vector(6),
        mixture: VmfMixture::from_rows(n, std::array::from_fn(|_| row())),
        inverse_distance: row(),
        statistics: SufficientStatistics::from_parts(std::array::from_fn(|_| row()), vector(9)),
        moments: LobeSums(std::array::from_fn(|_| row())),
    }
}

/// What training keeps true of a region, so that densities are finite and sampling follows them.
fn is_sane(region: &Region) -> bool {
    let n = region.mixture.len();
    let [weight, kappa, x, y, z] = region.mixture.rows();
    let (sums, [log_likelihood, total_weight, n_samples]) = region.statistics.parts();
    let is_amount = |v: f32| v.is_finite() && v >= 0.0;
    let amounts = region.spread.into_iter().chain([total_weight, n_samples, region.n_samples]);
    let is_lobe = |k: usize| {
        let length = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
        weight[k] > 0.0 && (0.0..=MAX_CONCENTRATION).contains(&kappa[k]) && (length - 1.0).abs() < ROUNDING
    };
    let mut per_lobe = region.moments.0.iter().chain([&region.inverse_distance, &sums[0], &sums[1]]);
    region.depth <= MOST_DEPTH
        && region.pivot.into_iter().chain([log_likelihood]).all(f32::is_finite)
        && amounts.into_iter().all(is_amount)
        && (0..n).all(is_lobe)
        && (weight.total() - 1.0).abs() < f64::from(ROUNDING)
        && per_lobe.all(|row| row.first(n).all(is_amount))
        && sums.iter().all(|row| row.first(n).all(f32::is_finite))
}
