//! An OpenVDB file: its list of grids, and one grid at a time on request.

use glam::DAffine3;
use rustc_hash::FxHashMap;

use crate::VdbError;
use crate::codec::Packing;
use crate::codec::block::BlockFormat;
use crate::cursor::Cursor;
use crate::descriptor::{Descriptor, GridInfo, TREE_SHAPE};
use crate::grid::{Grid, GridClass};
use crate::header::{COMPRESS_ACTIVE_MASK, Header, VERSION_NODE_MASKS};
use crate::metadata::{Metadata, read_metadata};
use crate::source::Source;
use crate::transform::{Transform, read_transform};
use crate::tree::{self, TreeSite};
use crate::value::Value;

/// What a file says before its voxels. The bytes stay in the [`Source`].
#[derive(Debug)]
pub(crate) struct Archive {
    header: Header,
    metadata: Metadata,
    descriptors: Vec<Descriptor>,
    n_unlisted: usize,
}

/// A grid's bytes up to its tree.
struct GridHead {
    compression: u32,
    metadata: Metadata,
    transform: Transform,
    /// Position of the tree.
    tree_at: usize,
}

impl Archive {
    /// Parses everything but voxels. A stream file has no table of offsets and must be walked from end to end, so it
    /// is read into memory.
    pub(crate) fn read(mut source: Source) -> Result<(Self, Source), VdbError> {
        let parse = |cursor: &mut Cursor<'_>| Ok((Header::read(cursor)?, read_metadata(cursor)?));
        let ((header, metadata), list_at) = source.parse(0..source.len(), parse)?;
        if !header.has_grid_offsets {
            source = source.into_memory()?;
        }
        let (descriptors, n_unlisted) = read_descriptors(&source, list_at, &header)?;
        Ok((Self { header, metadata, descriptors, n_unlisted }, source))
    }

    pub(crate) fn version(&self) -> u32 {
        self.header.version
    }

    /// Metadata of the file.
    pub(crate) fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    pub(crate) fn n_unlisted(&self) -> usize {
        self.n_unlisted
    }

    /// One entry per grid, in file order.
    pub(crate) fn list(&self, source: &Source) -> Vec<GridInfo> {
        let mut counts: FxHashMap<String, usize> = FxHashMap::default();
        let info = |descriptor: &Descriptor| {
            let Descriptor { value_type, tree_shape, saved_as_half, .. } = descriptor;
            let head = GridHead::read(source, &self.header, descriptor).ok();
            let file_from_index = match head.as_ref().map(|head| &head.transform) {
                Some(Transform::Linear(map)) => Some(*map),
                _ => None,
            };
            let metadata = head.map(|head| head.metadata).unwrap_or_default();
            let count = counts.entry(descriptor.name().to_owned()).or_default();
            *count += 1;
            GridInfo {
                name: descriptor.name().to_owned(),
                index: *count - 1,
                value_type: value_type.clone(),
                tree_shape: tree_shape.clone(),
                class: GridClass::from_metadata(&metadata),
                saved_as_half: *saved_as_half,
                is_instance: descriptor.is_instance(),
                metadata,
                file_from_index,
            }
        };
        self.descriptors.iter().map(info).collect()
    }

    /// Decodes the grid at `position` of the list, whose voxels are of type `T`, converting each value.
    pub(crate) fn decode<T: Value, U: Value>(
        &self,
        source: &Source,
        position: usize,
        convert: impl Fn(T) -> U + Sync,
    ) -> Result<Grid<U>, VdbError> {
        let descriptor = &self.descriptors[position];
        let head = GridHead::read(source, &self.header, descriptor)?;
        let file_from_index = linear(descriptor, &head.transform)?;
        let site = self.tree_site(source, descriptor, &head)?;
        let tree = tree::read(source, &site, convert)?;
        let mut grid = Grid::new(descriptor.name(), tree.background, file_from_index);
        grid.class = GridClass::from_metadata(&head.metadata);
        grid.metadata = head.metadata;
        grid.tiles = tree.tiles;
        grid.leaves = tree.leaves;
        Ok(grid)
    }

    /// Where a grid's tree is and how it is stored. An instance has its own metadata and transform but its parent's
    /// tree.
    fn tree_site(
        &self,
        source: &Source,
        descriptor: &Descriptor,
        head: &GridHead,
    ) -> Result<TreeSite, VdbError> {
        if !descriptor.is_instance() {
            return head.tree_site(&self.header, descriptor);
        }
        let parent = self.descriptors.iter().find(|other| other.unique_name == descriptor.parent);
        let is_usable =
            |other: &&Descriptor| !other.is_instance() && other.value_type == descriptor.value_type;
        let parent = parent.filter(is_usable).ok_or_else(|| {
            let what = format!("the grid whose tree \"{}\" shares is missing", descriptor.name());
            VdbError::corrupt(descriptor.body.start, what)
        })?;
        GridHead::read(source, &self.header, parent)?.tree_site(&self.header, parent)
    }
}

impl GridHead {
    fn read(source: &Source, header: &Header, descriptor: &Descriptor) -> Result<Self, VdbError> {
        let (mut head, tree_at) = source.parse(descriptor.body.clone(), |cursor| {
            let has_own_word = header.version >= VERSION_NODE_MASKS;
            let compression = if has_own_word { cursor.u32("compression")? } else { header.compression };
            let metadata = read_metadata(cursor)?;
            let transform = read_transform(cursor, header.version)?;
            Ok(Self { compression, metadata, transform, tree_at: 0 })
        })?;
        head.tree_at = tree_at;
        Ok(head)
    }

    fn tree_site(&self, header: &Header, descriptor: &Descriptor) -> Result<TreeSite, VdbError> {
        let format = block_format(header, descriptor, self.compression)?;
        Ok(TreeSite { bytes: self.tree_at..descriptor.body.end, buffers_at: descriptor.buffers_at, format })
    }
}

fn linear(descriptor: &Descriptor, transform: &Transform) -> Result<DAffine3, VdbError> {
    let unsupported = |what: String| Err(VdbError::unsupported(descriptor.name(), what));
    match transform {
        Transform::Linear(map) => Ok(*map),
        Transform::Frustum => unsupported("frustum transform".to_owned()),
        Transform::Unknown(kind) => unsupported(format!("{kind} transform")),
    }
}

/// How the tree's blocks are stored.
fn block_format(header: &Header, descriptor: &Descriptor, compression: u32) -> Result<BlockFormat, VdbError> {
    let unsupported = |what: String| VdbError::unsupported(descriptor.name(), what);
    let value_type = &descriptor.value_type;
    let values = value_type.layout(descriptor.saved_as_half);
    let values = values.ok_or_else(|| unsupported(format!("it is a {value_type} grid")))?;
    if descriptor.tree_shape != TREE_SHAPE {
        return Err(unsupported(format!("tree shape {} instead of {TREE_SHAPE}", descriptor.tree_shape)));
    }
    let mask_compressed = compression & COMPRESS_ACTIVE_MASK != 0;
    Ok(BlockFormat {
        version: header.version,
        packing: Packing::from_flags(compression),
        mask_compressed,
        values,
    })
}

/// The descriptors, and how many more there are that cannot be reached.
fn read_descriptors(
    source: &Source,
    list_at: usize,
    header: &Header,
) -> Result<(Vec<Descriptor>, usize), VdbError> {
    let file_len = source.len();
    let (count, mut next_at) = source.parse(list_at..file_len, |cursor| cursor.i32("grid count"))?;
    let count = usize::try_from(count).map_err(|_| VdbError::corrupt(list_at, "negative number of grids"))?;
    let least = count as u64 * Descriptor::SMALLEST;
    let available = file_len - next_at;
    if least > available as u64 {
        return Err(VdbError::Truncated { what: "grids", offset: next_at, needed: least, available });
    }
    let mut descriptors = Vec::new();
    while descriptors.len() < count {
        let read = |cursor: &mut Cursor<'_>| Descriptor::read(cursor, header.has_grid_offsets, file_len);
        let (mut descriptor, _) = source.parse(next_at..file_len, read)?;
        let end = if header.has_grid_offsets {
            Some(descriptor.body.end)
        } else {
            find_end(source, header, &descriptor)?
        };
        descriptor.body.end = end.unwrap_or(descriptor.body.end);
        next_at = descriptor.body.end;
        descriptors.push(descriptor);
        if end.is_none() {
            break;
        }
    }
    let n_unlisted = count - descriptors.len();
    Ok((descriptors, n_unlisted))
}

/// Where a grid in a stream file ends, `None` if its layout is unknown.
fn find_end(source: &Source, header: &Header, descriptor: &Descriptor) -> Result<Option<usize>, VdbError> {
    let head = GridHead::read(source, header, descriptor)?;
    if matches!(head.transform, Transform::Unknown(_)) {
        return Ok(None);
    }
    if descriptor.is_instance() {
        return Ok(Some(head.tree_at));
    }
    match head.tree_site(header, descriptor) {
        Ok(site) => tree::find_end(source, &site).map(Some),
        Err(_) => Ok(None),
    }
}
