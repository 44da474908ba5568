//! A whole file: the list of grids, and one grid at a time on request.

use std::path::Path;

use rustc_hash::FxHashMap;

use crate::VdbError;
use crate::codec::Packing;
use crate::codec::block::BlockFormat;
use crate::cursor::Cursor;
use crate::descriptor::{Descriptor, GridInfo, TREE_SHAPE};
use crate::grid::{Grid, GridClass};
use crate::header::{COMPRESS_ACTIVE_MASK, Header, VERSION_NODE_MASKS};
use crate::metadata::{MetaValue, Metadata, read_metadata};
use crate::transform::{Transform, read_transform};
use crate::tree::Skeleton;
use crate::value::{Scalar, Value, ValueType};

/// An opened VDB file. Only header, metadata and transforms are parsed; voxels are decoded by [`Self::read_grid`].
///
/// The bytes are held in memory. (Mapping the file would need `unsafe`, which the workspace reserves for one
/// module: the system cannot promise that a mapped file stays as it is.)
#[derive(Debug)]
pub struct VdbFile {
    bytes: Vec<u8>,
    header: Header,
    metadata: Metadata,
    descriptors: Vec<Descriptor>,
    grids: Vec<GridInfo>,
    n_unlisted: usize,
}

/// A grid's bytes up to its tree.
struct GridHead<'a> {
    compression: u32,
    metadata: Metadata,
    transform: Transform,
    /// At the tree.
    cursor: Cursor<'a>,
}

impl VdbFile {
    /// Reads a file into memory and parses everything but voxels.
    ///
    /// # Errors
    /// [`VdbError::Io`], [`VdbError::NotVdb`], [`VdbError::UnsupportedVersion`], or a header or list of grids that
    /// is cut off or contradicts itself.
    pub fn open(path: &Path) -> Result<Self, VdbError> {
        let bytes = std::fs::read(path).map_err(|source| VdbError::Io {
            action: "read",
            path: path.to_owned(),
            source,
        })?;
        Self::from_bytes(bytes)
    }

    /// As [`Self::open`], from bytes in memory.
    ///
    /// # Errors
    /// As [`Self::open`], except `Io`.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, VdbError> {
        let mut cursor = Cursor::new(&bytes, 0);
        let header = Header::read(&mut cursor)?;
        let metadata = read_metadata(&mut cursor)?;
        let (descriptors, n_unlisted) = read_descriptors(&bytes, &mut cursor, &header)?;
        let grids = list_grids(&bytes, &header, &descriptors);
        Ok(Self { bytes, header, metadata, descriptors, grids, n_unlisted })
    }

    /// The grids in file order.
    pub fn grids(&self) -> &[GridInfo] {
        &self.grids
    }

    /// Metadata of the file, not of a grid.
    pub fn metadata(&self) -> &[(String, MetaValue)] {
        &self.metadata
    }

    /// The file format version, 218 to 225.
    pub fn version(&self) -> u32 {
        self.header.version
    }

    /// Number of grids missing from [`Self::grids`]: in a stream file, what follows a grid of unknown layout cannot
    /// be found. Zero for all other files.
    pub fn n_unlisted_grids(&self) -> usize {
        self.n_unlisted
    }

    /// Decodes a grid of numbers into 32-bit floats; doubles and integers are rounded.
    ///
    /// `index` chooses among grids of the same name in file order, the first if `None`. `name` may also have
    /// OpenVDB's form `density[1]`.
    ///
    /// # Errors
    /// [`VdbError::NoSuchGrid`]; [`VdbError::UnsupportedGrid`] for vector, boolean, points and frustum grids;
    /// [`VdbError::Truncated`] and [`VdbError::Corrupt`] for damaged ones.
    pub fn read_grid(&self, name: &str, index: Option<usize>) -> Result<Grid, VdbError> {
        fn narrow<T: Scalar>(grid: Grid<T>) -> Grid {
            grid.map(T::to_f32)
        }
        let position = self.find(name, index)?;
        match self.descriptors[position].value_type {
            ValueType::Float => self.decode::<f32>(position),
            ValueType::Double => self.decode::<f64>(position).map(narrow),
            ValueType::Half => self.decode::<half::f16>(position).map(narrow),
            ValueType::Int32 => self.decode::<i32>(position).map(narrow),
            ValueType::Int64 => self.decode::<i64>(position).map(narrow),
            ref other => {
                Err(VdbError::unsupported(name, format!("it is a {other} grid, a float grid is needed")))
            }
        }
    }

    /// Decodes a grid in its own type, e.g. `[f32; 3]` for `vec3s`.
    ///
    /// # Errors
    /// As [`Self::read_grid`], and [`VdbError::UnsupportedGrid`] if the grid's type is not `T`.
    pub fn read_grid_as<T: Value>(&self, name: &str, index: Option<usize>) -> Result<Grid<T>, VdbError> {
        let position = self.find(name, index)?;
        let found = &self.descriptors[position].value_type;
        if *found != T::TYPE {
            let what = format!("it is a {found} grid, a {} grid is needed", T::TYPE);
            return Err(VdbError::unsupported(name, what));
        }
        self.decode(position)
    }

    fn find(&self, name: &str, index: Option<usize>) -> Result<usize, VdbError> {
        let position = |name: &str, index: usize| {
            self.grids.iter().position(|grid| grid.name == name && grid.index == index)
        };
        let bracketed = || {
            let (name, number) = name.strip_suffix(']')?.rsplit_once('[')?;
            number.parse().ok().and_then(|number| position(name, number))
        };
        let found = position(name, index.unwrap_or(0)).or_else(|| bracketed().filter(|_| index.is_none()));
        found.ok_or_else(|| VdbError::NoSuchGrid { name: name.to_owned(), index, available: self.names() })
    }

    /// Names for messages, `density[1]` for duplicates.
    fn names(&self) -> Vec<String> {
        let has_index = |grid: &GridInfo| grid.index > 0;
        let name = |grid: &GridInfo| {
            if has_index(grid) { format!("{}[{}]", grid.name, grid.index) } else { grid.name.clone() }
        };
        let unlisted = (self.n_unlisted > 0).then(|| format!("{} that cannot be reached", self.n_unlisted));
        self.grids.iter().map(name).chain(unlisted).collect()
    }

    fn decode<T: Value>(&self, position: usize) -> Result<Grid<T>, VdbError> {
        let descriptor = &self.descriptors[position];
        let name = descriptor.name();
        let mut head = GridHead::read(&self.bytes, &self.header, descriptor)?;
        let file_from_index = match head.transform {
            Transform::Linear(map) => map,
            Transform::Frustum => return Err(VdbError::unsupported(name, "frustum transform")),
            Transform::Unknown(kind) => return Err(VdbError::unsupported(name, format!("{kind} transform"))),
        };
        // An instance has its own metadata and transform but its parent's tree.
        let tree_owner = self.tree_owner(descriptor)?;
        let mut compression = head.compression;
        if descriptor.is_instance() {
            let parent = GridHead::read(&self.bytes, &self.header, tree_owner)?;
            (head.cursor, compression) = (parent.cursor, parent.compression);
        }
        let format = block_format(&self.header, tree_owner, compression)?;
        let skeleton = Skeleton::read(&mut head.cursor, format)?;
        let mut grid = Grid::new(name, skeleton.background::<T>(), file_from_index);
        grid.class = GridClass::from_metadata(&head.metadata);
        grid.metadata = head.metadata;
        grid.tiles = skeleton.decode_tiles()?;
        grid.leaves = skeleton.decode_leaves()?;
        Ok(grid)
    }

    fn tree_owner<'a>(&'a self, descriptor: &'a Descriptor) -> Result<&'a Descriptor, VdbError> {
        if !descriptor.is_instance() {
            return Ok(descriptor);
        }
        let parent = self.descriptors.iter().find(|other| other.unique_name == descriptor.parent);
        parent
            .filter(|parent| !parent.is_instance() && parent.value_type == descriptor.value_type)
            .ok_or_else(|| {
                let what = format!("the grid whose tree \"{}\" shares is missing", descriptor.name());
                VdbError::corrupt(descriptor.body.start, what)
            })
    }
}

impl<'a> GridHead<'a> {
    fn read(bytes: &'a [u8], header: &Header, descriptor: &Descriptor) -> Result<Self, VdbError> {
        let mut cursor = Cursor::new(&bytes[..descriptor.body.end], descriptor.body.start);
        let has_own_word = header.version >= VERSION_NODE_MASKS;
        let compression = if has_own_word { cursor.u32("compression")? } else { header.compression };
        let metadata = read_metadata(&mut cursor)?;
        let transform = read_transform(&mut cursor, header.version)?;
        Ok(Self { compression, metadata, transform, cursor })
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
fn read_descriptors<'a>(
    bytes: &'a [u8],
    cursor: &mut Cursor<'a>,
    header: &Header,
) -> Result<(Vec<Descriptor>, usize), VdbError> {
    let at = cursor.offset();
    let count = cursor.i32("grid count")?;
    let count = usize::try_from(count).map_err(|_| VdbError::corrupt(at, "negative number of grids"))?;
    cursor.require(count as u64 * Descriptor::SMALLEST, "grids")?;
    let mut descriptors = Vec::new();
    while descriptors.len() < count {
        let mut descriptor = Descriptor::read(cursor, header.has_grid_offsets)?;
        let end = if header.has_grid_offsets {
            Some(descriptor.body.end)
        } else {
            find_end(bytes, header, &descriptor)?
        };
        descriptor.body.end = end.unwrap_or(descriptor.body.end);
        *cursor = Cursor::new(bytes, descriptor.body.end);
        descriptors.push(descriptor);
        if end.is_none() {
            break;
        }
    }
    let n_unlisted = count - descriptors.len();
    Ok((descriptors, n_unlisted))
}

/// Where a grid in a stream file ends, `None` if its layout is unknown.
fn find_end(bytes: &[u8], header: &Header, descriptor: &Descriptor) -> Result<Option<usize>, VdbError> {
    let mut head = GridHead::read(bytes, header, descriptor)?;
    if matches!(head.transform, Transform::Unknown(_)) {
        return Ok(None);
    }
    if !descriptor.is_instance() {
        match block_format(header, descriptor, head.compression) {
            Ok(format) => Skeleton::read(&mut head.cursor, format)?,
            Err(_) => return Ok(None),
        };
    }
    Ok(Some(head.cursor.offset()))
}

fn list_grids(bytes: &[u8], header: &Header, descriptors: &[Descriptor]) -> Vec<GridInfo> {
    let mut counts: FxHashMap<String, usize> = FxHashMap::default();
    let info = |descriptor: &Descriptor| -> GridInfo {
        let Descriptor { value_type, tree_shape, saved_as_half, .. } = descriptor;
        let head = GridHead::read(bytes, header, descriptor).ok();
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
    descriptors.iter().map(info).collect()
}
