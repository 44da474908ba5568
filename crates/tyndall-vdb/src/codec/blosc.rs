//! Blosc 1 containers with LZ4 and byte shuffle: what OpenVDB writes since 2014.
//!
//! Source: the C-Blosc 1 chunk format (README_CHUNK_FORMAT). A 16-byte header
//! `version, codec version, flags, typesize, nbytes, blocksize, cbytes`, then the start of each block, then the
//! blocks. A block is one LZ4 stream, or one per byte of the type; after decoding, byte `k` of all values comes
//! first, then byte `k + 1`: "shuffled".

const HEADER_BYTES: usize = 16;
const FLAG_SHUFFLE: u8 = 0x1;
const FLAG_COPIED: u8 = 0x2;
const FLAG_BIT_SHUFFLE: u8 = 0x4;
const FLAG_ONE_STREAM: u8 = 0x10;
const CODEC_LZ4: u8 = 1;
/// Blosc splits a block into one stream per byte of the type only up to this type size...
const MAX_STREAMS: usize = 16;
/// ... and only if each stream gets at least this many bytes.
const MIN_STREAM_BYTES: usize = 128;

struct Header {
    flags: u8,
    type_size: usize,
    n_bytes: usize,
    block_size: usize,
}

/// Unpacks `packed` into exactly `out`; `shuffled` is scratch space.
pub(crate) fn unpack(packed: &[u8], out: &mut [u8], shuffled: &mut Vec<u8>) -> Result<(), &'static str> {
    let header = read_header(packed)?;
    if header.n_bytes != out.len() {
        return Err("Blosc values unpack to another size");
    }
    if header.flags & FLAG_COPIED != 0 {
        let bytes = packed.get(HEADER_BYTES..HEADER_BYTES + out.len()).ok_or("Blosc values are cut off")?;
        out.copy_from_slice(bytes);
        return Ok(());
    }
    unpack_blocks(packed, &header, out, shuffled)
}

fn unpack_blocks(
    packed: &[u8],
    header: &Header,
    out: &mut [u8],
    shuffled: &mut Vec<u8>,
) -> Result<(), &'static str> {
    if header.flags >> 5 != CODEC_LZ4 || header.flags & FLAG_BIT_SHUFFLE != 0 {
        return Err("Blosc values use a codec other than LZ4 with byte shuffle, such as BloscLZ");
    }
    if header.block_size == 0 || header.type_size == 0 {
        return Err("Blosc header has a zero size");
    }
    for (block_idx, block) in out.chunks_mut(header.block_size).enumerate() {
        let start = read_u32(packed, HEADER_BYTES + 4 * block_idx)?;
        unpack_block(packed, start, block, header, shuffled)?;
    }
    Ok(())
}

/// Unpacks the first bytes, from the first block alone. `packed` may be cut off behind that block.
pub(crate) fn unpack_front(packed: &[u8], out: &mut [u8]) -> Result<(), &'static str> {
    const CUT_OFF: &str = "Blosc values are cut off";
    /// No LZ4 block expands further.
    const MOST_EXPANSION: usize = 255;
    let header = read_header(packed)?;
    if header.flags & FLAG_COPIED != 0 {
        let bytes = packed.get(HEADER_BYTES..HEADER_BYTES + out.len()).ok_or(CUT_OFF)?;
        out.copy_from_slice(bytes);
        return Ok(());
    }
    let block_bytes = header.block_size.min(header.n_bytes);
    if block_bytes > packed.len().saturating_mul(MOST_EXPANSION) {
        return Err(CUT_OFF);
    }
    // A container of one block.
    let mut block = vec![0; block_bytes];
    let header = Header { n_bytes: block_bytes, ..header };
    unpack_blocks(packed, &header, &mut block, &mut Vec::new())?;
    out.copy_from_slice(block.get(..out.len()).ok_or(CUT_OFF)?);
    Ok(())
}

fn read_header(packed: &[u8]) -> Result<Header, &'static str> {
    let head = packed.first_chunk::<4>().ok_or("Blosc header is cut off")?;
    let (n_bytes, block_size) = (read_u32(packed, 4)?, read_u32(packed, 8)?);
    Ok(Header { flags: head[2], type_size: usize::from(head[3]), n_bytes, block_size })
}

fn read_u32(bytes: &[u8], at: usize) -> Result<usize, &'static str> {
    let four = bytes.get(at..).and_then(|tail| tail.first_chunk::<4>()).ok_or("Blosc values are cut off")?;
    Ok(u32::from_le_bytes(*four) as usize)
}

fn unpack_block(
    packed: &[u8],
    start: usize,
    block: &mut [u8],
    header: &Header,
    shuffled: &mut Vec<u8>,
) -> Result<(), &'static str> {
    let is_shuffled = header.flags & FLAG_SHUFFLE != 0 && header.type_size > 1;
    if !is_shuffled {
        return unpack_streams(packed, start, block, header);
    }
    shuffled.clear();
    shuffled.resize(block.len(), 0);
    unpack_streams(packed, start, shuffled, header)?;
    unshuffle(shuffled, block, header.type_size);
    Ok(())
}

/// Each stream is a 32-bit size and that many bytes; a size equal to the unpacked one means "not compressed".
fn unpack_streams(packed: &[u8], start: usize, out: &mut [u8], header: &Header) -> Result<(), &'static str> {
    let is_partial = out.len() < header.block_size;
    let is_split = header.flags & FLAG_ONE_STREAM == 0
        && !is_partial
        && header.type_size <= MAX_STREAMS
        && header.block_size / header.type_size >= MIN_STREAM_BYTES;
    let n_streams = if is_split { header.type_size } else { 1 };
    if !out.len().is_multiple_of(n_streams) {
        return Err("Blosc block does not split evenly");
    }
    let mut at = start;
    for stream in out.chunks_mut(out.len() / n_streams) {
        let size = read_u32(packed, at)?;
        at = at.saturating_add(4);
        let bytes = packed.get(at..at.saturating_add(size)).ok_or("Blosc values are cut off")?;
        at = at.saturating_add(size);
        unpack_stream(bytes, stream)?;
    }
    Ok(())
}

fn unpack_stream(bytes: &[u8], out: &mut [u8]) -> Result<(), &'static str> {
    if bytes.len() == out.len() {
        out.copy_from_slice(bytes);
        return Ok(());
    }
    match lz4_flex::block::decompress_into(bytes, out) {
        Ok(written) if written == out.len() => Ok(()),
        Ok(_) => Err("LZ4 values unpack to another size"),
        Err(_) => Err("LZ4 values do not unpack"),
    }
}

/// Puts byte `k` of value `i` from position `k * n_values + i` to `i * type_size + k`; bytes that do not fill a
/// value stay at the end.
fn unshuffle(shuffled: &[u8], out: &mut [u8], type_size: usize) {
    // OpenVDB and NanoVDB always say four, whatever the values are.
    if type_size == 4 { unshuffle_fours(shuffled, out) } else { unshuffle_any(shuffled, out, type_size) }
}

fn unshuffle_any(shuffled: &[u8], out: &mut [u8], type_size: usize) {
    let n_values = out.len() / type_size;
    let whole = n_values * type_size;
    for (i, value) in out[..whole].chunks_exact_mut(type_size).enumerate() {
        for (k, byte) in value.iter_mut().enumerate() {
            *byte = shuffled[k * n_values + i];
        }
    }
    out[whole..].copy_from_slice(&shuffled[whole..]);
}

/// Four streams side by side, put together as numbers: the compiler makes that wide, twice as fast as with bytes.
fn unshuffle_fours(shuffled: &[u8], out: &mut [u8]) {
    let n_values = out.len() / 4;
    let (values, tail) = out.as_chunks_mut::<4>();
    let (bytes_0, rest) = shuffled.split_at(n_values);
    let (bytes_1, rest) = rest.split_at(n_values);
    let (bytes_2, rest) = rest.split_at(n_values);
    let (bytes_3, rest) = rest.split_at(n_values);
    let streams = bytes_0.iter().zip(bytes_1).zip(bytes_2).zip(bytes_3);
    for (value, (((b0, b1), b2), b3)) in values.iter_mut().zip(streams) {
        let [b0, b1, b2, b3] = [*b0, *b1, *b2, *b3].map(u32::from);
        *value = (b0 | b1 << 8 | b2 << 16 | b3 << 24).to_le_bytes();
    }
    tail.copy_from_slice(rest);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn container(flags: u8, type_size: u8, n_bytes: u32, block_size: u32, body: &[u8]) -> Vec<u8> {
        let mut bytes = vec![2, 1, flags, type_size];
        bytes.extend(n_bytes.to_le_bytes());
        bytes.extend(block_size.to_le_bytes());
        bytes.extend((16 + body.len() as u32).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    fn unpacked(packed: &[u8], size: usize) -> Result<Vec<u8>, &'static str> {
        let mut out = vec![0; size];
        unpack(packed, &mut out, &mut Vec::new()).map(|()| out)
    }

    /// Two blocks of 256 bytes and a partial one, in one stream each: the layout of OpenVDB 3 files.
    #[test]
    fn several_blocks_with_a_partial_last_one() {
        let data: Vec<u8> = (0..600_u32).map(|i| (i % 11) as u8).collect();
        let mut starts = Vec::new();
        let mut blocks = Vec::new();
        for block in data.chunks(256) {
            starts.extend((16 + 12 + blocks.len() as u32).to_le_bytes());
            let n = block.len() / 4;
            let shuffled: Vec<u8> = (0..block.len()).map(|j| block[j % n * 4 + j / n]).collect();
            let packed = lz4_flex::block::compress(&shuffled);
            blocks.extend((packed.len() as u32).to_le_bytes());
            blocks.extend(packed);
        }
        let packed = container(FLAG_SHUFFLE | CODEC_LZ4 << 5, 4, 600, 256, &[starts, blocks].concat());
        assert_eq!(unpacked(&packed, 600).as_deref(), Ok(&data[..]));
    }

    #[test]
    fn four_streams_unshuffle_like_any() {
        for size in (0..70).chain([1023, 2048]) {
            let shuffled: Vec<u8> = (0..size).map(|i| (i * 31 % 257) as u8).collect();
            let (mut fast, mut slow) = (vec![0; size], vec![1; size]);
            unshuffle(&shuffled, &mut fast, 4);
            unshuffle_any(&shuffled, &mut slow, 4);
            assert_eq!(fast, slow, "{size}");
        }
    }

    #[test]
    fn copied_containers_and_their_cut_off_forms() {
        let packed = container(FLAG_COPIED, 4, 4, 4, &[1, 2, 3, 4]);
        assert_eq!(unpacked(&packed, 4), Ok(vec![1, 2, 3, 4]));
        for cut in 0..packed.len() {
            assert!(unpacked(&packed[..cut], 4).is_err());
        }
        assert!(unpacked(&packed, 5).is_err());
    }

    #[test]
    fn hostile_headers_are_errors() {
        let body = [20, 0, 0, 0, 4, 0, 0, 0, 1, 2, 3, 4];
        let lz4 = CODEC_LZ4 << 5;
        assert!(unpacked(&container(lz4, 4, 4, 0, &body), 4).is_err());
        assert!(unpacked(&container(lz4, 0, 4, 4, &body), 4).is_err());
        assert!(unpacked(&container(lz4 | FLAG_BIT_SHUFFLE, 4, 4, 4, &body), 4).is_err());
        assert!(unpacked(&container(3 << 5, 4, 4, 4, &body), 4).is_err());
        let far = [255, 255, 255, 255, 4, 0, 0, 0];
        assert!(unpacked(&container(lz4, 4, 4, 4, &far), 4).is_err());
    }
}
