//! Numbers in buffers: single ones looked up when they are needed, in any of the types that the format has, so that what
//! an accessor claims to hold costs nothing.

use super::buffers::Buffers;
use super::document::{Accessor, Document, Sparse};

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// By the number that the specification gives to it.
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn byte_count(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the beginning of some bytes, and the largest of its type, which stands for 1 where numbers are
    /// normalised.
    fn number(self, bytes: &[u8]) -> Option<(f32, f32)> {
        Some(match self {
            Self::I8 => (f32::from(i8::from_le_bytes(*bytes.first_chunk()?)), 127.0),
            Self::U8 => (f32::from(*bytes.first()?), 255.0),
            Self::I16 => (
                f32::from(i16::from_le_bytes(*bytes.first_chunk()?)),
                32_767.0,
            ),
            Self::U16 => (
                f32::from(u16::from_le_bytes(*bytes.first_chunk()?)),
                65_535.0,
            ),
            Self::U32 => (
                u32::from_le_bytes(*bytes.first_chunk()?) as f32,
                u32::MAX as f32,
            ),
            Self::F32 => (f32::from_le_bytes(*bytes.first_chunk()?), 1.0),
        })
    }

    /// The same where it is an index.
    fn index(self, bytes: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(u32::from(*bytes.first()?)),
            Self::U16 => Some(u32::from(u16::from_le_bytes(*bytes.first_chunk()?))),
            Self::U32 => Some(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::I8 | Self::I16 | Self::F32 => None,
        }
    }
}

/// Elements of one size at equal distances.
#[derive(Clone, Copy, Debug)]
struct Row<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
}

impl<'a> Row<'a> {
    /// So many elements from an offset on.
    fn new(
        bytes: &'a [u8],
        offset: u64,
        stride: Option<u64>,
        size: usize,
        count: u64,
    ) -> Result<Self, String> {
        let beyond = || "numbers lie beyond the end of their buffer view".to_owned();
        let stride = match stride {
            None | Some(0) => size,
            Some(stride) => usize::try_from(stride).map_err(|_| beyond())?,
        };
        if stride < size {
            return Err("numbers overlap: a byteStride is too small".to_owned());
        }
        let offset = usize::try_from(offset).map_err(|_| beyond())?;
        let bytes = bytes.get(offset..).ok_or_else(beyond)?;
        let last = count.saturating_sub(1).checked_mul(stride as u64);
        let end = last.and_then(|last| last.checked_add(size as u64));
        match end {
            Some(end) if count == 0 || end <= bytes.len() as u64 => Ok(Self {
                bytes,
                stride,
                size,
            }),
            _ => Err(beyond()),
        }
    }

    fn get(&self, index: usize) -> Option<&'a [u8]> {
        let start = index.checked_mul(self.stride)?;
        self.bytes.get(start..start.checked_add(self.size)?)
    }
}

/// Elements in place of others; their indices ascend.
#[derive(Clone, Copy, Debug)]
struct Exceptions<'a> {
    indices: Row<'a>,
    component: Component,
    values: Row<'a>,
    count: usize,
}

impl<'a> Exceptions<'a> {
    fn of(buffers: &'a Buffers, sparse: &Sparse, size: usize) -> Result<Self, String> {
        let Sparse {
            count,
            indices,
            values,
        } = sparse;
        let component = Component::of(indices.component_type)
            .ok_or("numbers have a type that glTF does not know")?;
        let bytes = buffers.view(indices.buffer_view)?;
        let width = component.byte_count();
        let index_row = Row::new(bytes, indices.byte_offset, None, width, *count)?;
        let bytes = buffers.view(values.buffer_view)?;
        Ok(Self {
            indices: index_row,
            component,
            values: Row::new(bytes, values.byte_offset, None, size, *count)?,
            count: usize::try_from(*count).unwrap_or(0),
        })
    }

    fn get(&self, index: usize) -> Option<&'a [u8]> {
        let place_of = |at: usize| {
            let place = self.component.index(self.indices.get(at)?)?;
            Some(place as usize)
        };
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match place_of(middle)?.cmp(&index) {
                std::cmp::Ordering::Equal => return self.values.get(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

/// The elements of an accessor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elements<'a> {
    count: usize,
    component: Component,
    is_normalized: bool,
    width: usize,
    /// Nothing where all are 0.
    row: Option<Row<'a>>,
    exceptions: Option<Exceptions<'a>>,
}

impl<'a> Elements<'a> {
    /// Those of an accessor with one of these widths: 1 for scalars, 3 for vectors of three numbers and so on.
    ///
    /// # Errors
    /// The problem, without a remedy.
    pub(super) fn of(
        document: &Document,
        buffers: &'a Buffers,
        index: usize,
        widths: &[usize],
    ) -> Result<Self, String> {
        let accessor = document.accessors.get(index);
        let accessor = accessor.ok_or("an accessor that does not exist is named")?;
        let unknown = "numbers have a type that glTF does not know";
        let component = Component::of(accessor.component_type).ok_or(unknown)?;
        let width = width(accessor).filter(|width| widths.contains(width));
        let width = width.ok_or("an attribute has a number of components that it cannot have")?;
        let size = component.byte_count() * width;
        let row = match accessor.buffer_view {
            None => None,
            Some(view) => {
                let bytes = buffers.view(view)?;
                let stride = document.buffer_views[view].byte_stride;
                Some(Row::new(
                    bytes,
                    accessor.byte_offset,
                    stride,
                    size,
                    accessor.count,
                )?)
            }
        };
        let exceptions = match &accessor.sparse {
            None => None,
            Some(sparse) => Some(Exceptions::of(buffers, sparse, size)?),
        };
        Ok(Self {
            count: usize::try_from(accessor.count).map_err(|_| "there are too many numbers")?,
            component,
            is_normalized: accessor.normalized,
            width,
            row,
            exceptions,
        })
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The first numbers of an element; nothing of one that is not there. Those that it does not have are 1.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Option<[f32; N]> {
        let Some(bytes) = self.bytes(index)? else {
            return Some([0.0; N]);
        };
        let size = self.component.byte_count();
        let mut floats = [1.0; N];
        for (float, bytes) in floats.iter_mut().zip(bytes.chunks(size)).take(self.width) {
            let (number, largest) = self.component.number(bytes)?;
            *float = match self.is_normalized {
                true => (number / largest).max(-1.0),
                false => number,
            };
        }
        Some(floats)
    }

    /// An element that is an index.
    pub(super) fn index(&self, index: usize) -> Option<u32> {
        match self.bytes(index)? {
            Some(bytes) => self.component.index(bytes),
            None => Some(0),
        }
    }

    /// Whether no data says what they are.
    pub(super) fn are_zero(&self) -> bool {
        self.row.is_none() && self.exceptions.is_none()
    }

    /// Whether the elements may be indices.
    pub(super) fn are_indices(&self) -> bool {
        matches!(
            self.component,
            Component::U8 | Component::U16 | Component::U32
        )
    }

    /// The bytes of an element: of one that is 0, `Some(None)`.
    fn bytes(&self, index: usize) -> Option<Option<&'a [u8]>> {
        if index >= self.count {
            return None;
        }
        let other = self.exceptions.and_then(|exceptions| exceptions.get(index));
        match (other, self.row) {
            (Some(bytes), _) => Some(Some(bytes)),
            (None, Some(row)) => row.get(index).map(Some),
            (None, None) => Some(None),
        }
    }
}

/// Numbers of an element.
fn width(accessor: &Accessor) -> Option<usize> {
    Some(match accessor.kind.as_str() {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => return None,
    })
}
