//! Sections with checksums, behind a header that says what they are.
//!
//! ```text
//!  0  magic                8 bytes; not ASCII, and damaged by transfers that change line ends
//!  8  byte order           u32, 0x0a0b0c0d
//! 12  format               u32
//! 16  features             u64, bits; one that a reader does not know makes the file unreadable for it
//! 24  sections             u32
//! 28  0                    u32
//! 32  renderer's version   32 bytes of UTF-8, filled up with 0
//! 64  table                a row of 40 bytes a section: kind u32, 0 u32, stored u64, unpacked u64, checksum 16 bytes
//!  …  checksum of all above, 16 bytes
//!  …  the sections, one after the other, and nothing else
//! ```
//!
//! All numbers are little-endian; checksums are the first half of BLAKE3. Every byte of a file is under some checksum.

use super::blocks::{self, Unpacking};
use super::error::{CacheError, Result};
use super::words::{Reader, Writer};
use rayon::prelude::*;

/// The latest format, and the only one that is read.
pub const FORMAT: u32 = 3;
/// How a cache begins.
pub const MAGIC: [u8; 8] = *b"\x93TYC\r\n\x1a\n";

const BYTE_ORDER: u32 = 0x0a0b_0c0d;
const HEADER: usize = 64;
const ROW: usize = 40;
const MOST_SECTIONS: u32 = 64;
const VERSION: usize = 32;
/// No cache of ours comes near; a header that says more is not believed.
const MOST_BYTES: u64 = 1 << 36;

type Checksum = [u8; 16];

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Summary,
    Field,
    Image,
}

impl Kind {
    pub(super) const ALL: [Self; 3] = [Self::Summary, Self::Field, Self::Image];

    fn code(self) -> u32 {
        self as u32 + 1
    }

    fn feature(self) -> u64 {
        1 << self as u32
    }

    fn name(self) -> &'static str {
        match self {
            Self::Summary => "summary",
            Self::Field => "field",
            Self::Image => "image guide",
        }
    }
}

/// Sections and who wrote them, to be written.
pub(super) struct Container {
    pub(super) renderer: String,
    pub(super) sections: Vec<(Kind, Vec<u8>)>,
}

/// A file whose checksums are right.
pub(super) struct Opened<'a> {
    pub(super) renderer: String,
    sections: Vec<(Kind, &'a [u8], u64)>,
}

impl Container {
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let stored: Vec<_> = self.sections.iter().map(|(_, raw)| blocks::compress(raw)).collect();
        let mut out = Writer::default();
        out.bytes(&MAGIC);
        out.u32(BYTE_ORDER);
        out.u32(FORMAT);
        out.u64(self.sections.iter().fold(0, |bits, (kind, _)| bits | kind.feature()));
        out.u32(self.sections.len() as u32);
        out.u32(0);
        out.bytes(&padded(&self.renderer));
        for ((kind, raw), stored) in self.sections.iter().zip(&stored) {
            out.u32(kind.code());
            out.u32(0);
            out.u64(stored.len() as u64);
            out.u64(raw.len() as u64);
            out.bytes(&checksum(stored));
        }
        let mut bytes = out.finish();
        bytes.extend(checksum(&bytes));
        stored.iter().for_each(|stored| bytes.extend(stored));
        bytes
    }
}

impl<'a> Opened<'a> {
    pub(super) fn from_bytes(bytes: &'a [u8]) -> Result<Self> {
        let header = Header::read(bytes)?;
        let sections = header.rows.par_iter().zip(header.split(bytes)?);
        let checked = sections.map(|(row, stored)| {
            let is_whole = checksum(stored) == row.checksum;
            is_whole.then_some((row.kind, stored, row.unpacked)).ok_or(CacheError::Checksum(row.kind.name()))
        });
        Ok(Self { sections: checked.collect::<Result<_>>()?, renderer: header.renderer })
    }

    pub(super) fn section(&self, kind: Kind) -> Result<Option<Unpacking<'a>>> {
        let found = self.sections.iter().find(|(k, ..)| *k == kind);
        found.map(|(_, stored, unpacked)| Unpacking::new(stored, *unpacked)).transpose()
    }
}

struct Row {
    kind: Kind,
    stored: u64,
    unpacked: u64,
    checksum: Checksum,
}

struct Header {
    renderer: String,
    rows: Vec<Row>,
    /// Where the sections begin.
    end: usize,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self> {
        if !bytes.starts_with(&MAGIC) {
            return Err(CacheError::NotACache);
        }
        let actual = bytes.len() as u64;
        let short = |expected: usize| CacheError::Length { expected: expected as u64, actual };
        let mut fixed = Reader::new(bytes.get(MAGIC.len()..HEADER).ok_or(short(HEADER))?);
        if fixed.u32()? != BYTE_ORDER {
            return Err(CacheError::Foreign("it is not of this byte order"));
        }
        // Before the checksum, whose place another format may have changed.
        match fixed.u32()? {
            FORMAT => {}
            found if found > FORMAT => return Err(CacheError::Newer { found, known: FORMAT }),
            _ => {
                return Err(CacheError::Foreign(
                    "it is of an earlier format; learn it anew by --cache-mode train",
                ));
            }
        }
        let features = fixed.u64()?;
        let n_sections = fixed.u32()?;
        if n_sections > MOST_SECTIONS {
            return Err(CacheError::Malformed("its header announces too many sections"));
        }
        let table_end = HEADER + ROW * n_sections as usize;
        let end = table_end + size_of::<Checksum>();
        let head = bytes.get(..end).ok_or(short(end))?;
        if checksum(&head[..table_end]) != head[table_end..] {
            return Err(CacheError::Checksum("header"));
        }
        let known = Kind::ALL.iter().fold(0, |bits, kind| bits | kind.feature());
        if features & !known != 0 {
            return Err(CacheError::UnknownFeatures(features & !known));
        }
        let renderer = text(&head[HEADER - VERSION..HEADER]);
        let rows = head[HEADER..table_end].chunks_exact(ROW).map(Row::read).collect::<Result<_>>()?;
        Ok(Self { renderer, rows, end })
    }

    /// The stored bytes of each section.
    fn split<'a>(&self, bytes: &'a [u8]) -> Result<Vec<&'a [u8]>> {
        let expected = self.rows.iter().map(|row| row.stored).sum::<u64>() + self.end as u64;
        if expected != bytes.len() as u64 {
            return Err(CacheError::Length { expected, actual: bytes.len() as u64 });
        }
        let mut rest = Reader::new(&bytes[self.end..]);
        self.rows.iter().map(|row| rest.bytes(row.stored as usize)).collect()
    }
}

impl Row {
    fn read(bytes: &[u8]) -> Result<Self> {
        let mut row = Reader::new(bytes);
        let code = row.u32()?;
        let kind = Kind::ALL.into_iter().find(|kind| kind.code() == code);
        let kind = kind.ok_or(CacheError::Malformed("its header names an unknown section"))?;
        row.u32()?;
        let (stored, unpacked) = (row.u64()?, row.u64()?);
        if stored.max(unpacked) > MOST_BYTES {
            return Err(CacheError::Malformed("its header announces too large a section"));
        }
        Ok(Self { kind, stored, unpacked, checksum: row.array()? })
    }
}

fn checksum(bytes: &[u8]) -> Checksum {
    let mut half = Checksum::default();
    let hash = blake3::Hasher::new().update_rayon(bytes).finalize();
    half.copy_from_slice(&hash.as_bytes()[..size_of::<Checksum>()]);
    half
}

fn padded(version: &str) -> [u8; VERSION] {
    let mut bytes = [0; VERSION];
    bytes.iter_mut().zip(version.bytes()).for_each(|(to, from)| *to = from);
    bytes
}

fn text(padded: &[u8]) -> String {
    let end = padded.iter().position(|&b| b == 0).unwrap_or(padded.len());
    String::from_utf8_lossy(&padded[..end]).into_owned()
}
