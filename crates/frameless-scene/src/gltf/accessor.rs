//! Typed arrays inside buffer views (glTF 2.0 §3.6.2): strided, normalised, sparse.

use super::buffers::{View, slice};
use super::error::Fault;
use super::json::Json;
use super::limits::Budget;

/// An array of `count` elements of `width` components, all of whose bytes are known to be there.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    pub(super) count: usize,
    pub(super) component: Component,
    /// Components per element: 1 (SCALAR) to 16 (MAT4).
    pub(super) width: usize,
    /// As in the file: SCALAR to MAT4.
    kind: &'static str,
    pub(super) pointer: String,
    /// Integers stand for fractions in [0, 1] or [−1, 1].
    normalized: bool,
    /// `None`: all zeros.
    dense: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements at equal distances; the last one ends within `bytes`.
#[derive(Clone, Copy, Debug)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
    /// See [`View::in_file`].
    in_file: bool,
}

impl<'a> Strided<'a> {
    fn element(&self, index: usize) -> &'a [u8] {
        &self.bytes[index * self.stride..]
    }
}

/// Elements that replace some of the dense ones.
#[derive(Debug)]
struct Sparse<'a> {
    count: usize,
    indices: Strided<'a>,
    index_component: Component,
    values: Strided<'a>,
    pointer: String,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn parse(json: &Json<'_>) -> Result<Component, Fault> {
        match json.unsigned()? {
            5120 => Ok(Component::I8),
            5121 => Ok(Component::U8),
            5122 => Ok(Component::I16),
            5123 => Ok(Component::U16),
            5125 => Ok(Component::U32),
            5126 => Ok(Component::F32),
            _ => Err(json.fault("a component type: 5120, 5121, 5122, 5123, 5125 or 5126")),
        }
    }

    fn number_in_file(self) -> u32 {
        match self {
            Component::I8 => 5120,
            Component::U8 => 5121,
            Component::I16 => 5122,
            Component::U16 => 5123,
            Component::U32 => 5125,
            Component::F32 => 5126,
        }
    }

    fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The first component of `bytes` as a number.
    ///
    /// Normalised integers (glTF 2.0 §3.11): unsigned c / max; signed max(c / max, −1).
    fn number(self, bytes: &[u8], normalized: bool) -> f32 {
        let (value, largest) = match self {
            Component::I8 => (f32::from(bytes[0] as i8), f32::from(i8::MAX)),
            Component::U8 => (f32::from(bytes[0]), f32::from(u8::MAX)),
            Component::I16 => {
                (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), f32::from(i16::MAX))
            }
            Component::U16 => {
                (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), f32::from(u16::MAX))
            }
            Component::U32 => (self.whole(bytes) as f32, u32::MAX as f32),
            Component::F32 => return f32::from_bits(self.whole(bytes)),
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }

    /// The first component of `bytes` as an unsigned number: the bits of it, for types that are none.
    fn whole(self, bytes: &[u8]) -> u32 {
        match self.bytes() {
            1 => u32::from(bytes[0]),
            2 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

/// All accessors of the file, each within its views.
pub(super) fn parse_accessors<'a>(
    root: &Json<'_>,
    views: &[View<'a>],
) -> Result<Vec<Accessor<'a>>, Fault> {
    root.list("accessors")?.iter().map(|json| Accessor::parse(json, views)).collect()
}

impl<'a> Accessor<'a> {
    fn parse(json: &Json<'_>, views: &[View<'a>]) -> Result<Accessor<'a>, Fault> {
        let component = Component::parse(&json.required("componentType")?)?;
        let (kind, width, bytes) = element_size(&json.required("type")?, component)?;
        let count_json = json.required("count")?;
        let count = count_json.unsigned()?;
        let dense = match json.field("bufferView")? {
            None => None,
            Some(view) => {
                let view = views[view.index(views.len(), "buffer views")?];
                let offset = json.unsigned_or("byteOffset", 0)?;
                Some(strided(view, offset, count, bytes, &count_json)?)
            }
        };
        let sparse = match json.field("sparse")? {
            None => None,
            Some(sparse) => Some(Sparse::parse(&sparse, views, count, bytes)?),
        };
        let normalized = json.flag("normalized")?;
        let pointer = json.pointer().to_owned();
        Ok(Accessor { count, component, width, kind, pointer, normalized, dense, sparse })
    }

    /// The bytes of the file that it is of.
    pub(super) fn pieces(&self) -> impl Iterator<Item = &'a [u8]> {
        let sparse = self.sparse.iter().flat_map(|sparse| [sparse.indices, sparse.values]);
        let all = self.dense.into_iter().chain(sparse);
        all.filter(|strided| strided.in_file).map(|strided| strided.bytes)
    }

    /// Refuses elements of other kinds than `user` can use, where they are used.
    pub(super) fn check_kind(&self, kinds: &[&str], user: &Json<'_>) -> Result<(), Fault> {
        if kinds.contains(&self.kind) {
            return Ok(());
        }
        let kinds = kinds.join(" or ");
        let components = match kinds.as_str() {
            "SCALAR" => "1 component",
            "VEC2" => "2 components",
            "VEC3" => "3 components",
            "VEC4" => "4 components",
            "MAT4" => "16 components",
            "VEC3 or VEC4" => "3 or 4 components",
            _ => "other components",
        };
        let came = format!("{} of {}", self.kind, self.pointer);
        Err(Fault::at(user.pointer(), format!("{components} per element ({kinds})"), came))
    }

    /// The elements as `N` numbers each, integers converted; numbers may be infinite or NaN. Their kind should have been
    /// [checked](Accessor::check_kind).
    pub(super) fn numbers<const N: usize>(
        &self,
        budget: &mut Budget,
    ) -> Result<Vec<[f32; N]>, Fault> {
        if self.width != N {
            let came = format!("{} components", self.width);
            return Err(Fault::at(&self.pointer, format!("{N} components per element"), came));
        }
        let (component, normalized) = (self.component, self.normalized);
        self.elements(budget, |bytes| {
            let step = component.bytes();
            std::array::from_fn(|i| component.number(&bytes[i * step..], normalized))
        })
    }

    /// The elements as unsigned numbers, as primitives index vertices.
    pub(super) fn indices(&self, budget: &mut Budget) -> Result<Vec<u32>, Fault> {
        self.elements(budget, |bytes| self.component.whole(bytes))
    }

    /// The highest of them, if they are all stored as they are: neither zeros nor sparse.
    pub(super) fn highest_stored_index(&self) -> Option<u32> {
        let dense = self.dense.filter(|_| self.sparse.is_none())?;
        (0..self.count).map(|i| self.component.whole(dense.element(i))).max()
    }

    /// Refuses what cannot be the indices of `user`.
    pub(super) fn check_indices(&self, user: &Json<'_>) -> Result<(), Fault> {
        let component = self.component;
        let unsigned = matches!(component, Component::U8 | Component::U16 | Component::U32);
        if self.kind == "SCALAR" && unsigned {
            return Ok(());
        }
        Err(self.is_other(user, "unsigned scalars (5121, 5123 or 5125) as indices"))
    }

    /// Refuses what cannot be joint numbers.
    pub(super) fn check_joints(&self, user: &Json<'_>) -> Result<(), Fault> {
        let fits = matches!(self.component, Component::U8 | Component::U16);
        if self.kind == "VEC4" && fits {
            return Ok(());
        }
        Err(self.is_other(user, "VEC4 of 5121 or 5123 as joints"))
    }

    fn is_other(&self, user: &Json<'_>, wanted: &str) -> Fault {
        let came =
            format!("{} of {} in {}", self.kind, self.component.number_in_file(), self.pointer);
        Fault::at(user.pointer(), wanted, came)
    }

    /// The elements as four joint numbers each; [checked](Accessor::check_joints).
    pub(super) fn joints(&self, budget: &mut Budget) -> Result<Vec<[u16; 4]>, Fault> {
        let component = self.component;
        let step = component.bytes();
        let read =
            |bytes: &[u8]| std::array::from_fn(|k| component.whole(&bytes[k * step..]) as u16);
        self.elements(budget, read)
    }

    fn elements<T: Clone>(
        &self,
        budget: &mut Budget,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Fault> {
        let (count, each) = (self.count, size_of::<T>());
        let mut elements = match self.dense {
            Some(dense) => {
                budget.allocate(&self.pointer, count, each)?;
                (0..count).map(|i| read(dense.element(i))).collect()
            }
            None => {
                budget.allocate_zeros(&self.pointer, count, each)?;
                // Every type of element is at most 16 components of 4 bytes.
                vec![read(&[0; 64]); count]
            }
        };
        if let Some(sparse) = &self.sparse {
            sparse.replace(&mut elements, read)?;
        }
        Ok(elements)
    }
}

impl<'a> Sparse<'a> {
    fn parse(
        json: &Json<'_>,
        views: &[View<'a>],
        dense_count: usize,
        value_bytes: usize,
    ) -> Result<Sparse<'a>, Fault> {
        let count_json = json.required("count")?;
        let count = count_json.unsigned()?;
        if count > dense_count {
            return Err(count_json.fault(format!("at most {dense_count} sparse elements")));
        }
        let part = |part: &Json<'_>, bytes| -> Result<Strided<'a>, Fault> {
            let view = views[part.required("bufferView")?.index(views.len(), "buffer views")?];
            let packed = View { stride: None, ..view };
            strided(packed, part.unsigned_or("byteOffset", 0)?, count, bytes, &count_json)
        };
        let indices_json = json.required("indices")?;
        let component_json = indices_json.required("componentType")?;
        let index_component = Component::parse(&component_json)?;
        if !matches!(index_component, Component::U8 | Component::U16 | Component::U32) {
            return Err(component_json.fault("an unsigned type: 5121, 5123 or 5125"));
        }
        let indices = part(&indices_json, index_component.bytes())?;
        let values = part(&json.required("values")?, value_bytes)?;
        let pointer = indices_json.pointer().to_owned();
        Ok(Sparse { count, indices, index_component, values, pointer })
    }

    fn replace<T>(&self, elements: &mut [T], read: impl Fn(&[u8]) -> T) -> Result<(), Fault> {
        let count = elements.len();
        let mut last = None;
        for i in 0..self.count {
            let index = self.index_component.whole(self.indices.element(i));
            if let Some(last) = last.replace(index).filter(|&last| last >= index) {
                let came = format!("{index} after {last}");
                return Err(Fault::at(&self.pointer, "indices each higher than the last", came));
            }
            let Some(element) = elements.get_mut(index as usize) else {
                return Err(Fault::at(&self.pointer, format!("indices below {count}"), index));
            };
            *element = read(self.values.element(i));
        }
        Ok(())
    }
}

/// Kind, components and bytes of an element. Columns of matrices begin at multiples of four bytes (glTF 2.0 §3.6.2.4).
fn element_size(
    json: &Json<'_>,
    component: Component,
) -> Result<(&'static str, usize, usize), Fault> {
    let bytes = component.bytes();
    let (kind, rows, columns) = match json.text()? {
        "SCALAR" => ("SCALAR", 1, 1),
        "VEC2" => ("VEC2", 2, 1),
        "VEC3" => ("VEC3", 3, 1),
        "VEC4" => ("VEC4", 4, 1),
        "MAT2" => ("MAT2", 2, 2),
        "MAT3" => ("MAT3", 3, 3),
        "MAT4" => ("MAT4", 4, 4),
        _ => return Err(json.fault("SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4")),
    };
    let column_bytes = if columns > 1 { (rows * bytes).next_multiple_of(4) } else { rows * bytes };
    Ok((kind, rows * columns, column_bytes * columns))
}

/// `count` elements of `bytes` each in `view`, from `offset` on.
fn strided<'a>(
    view: View<'a>,
    offset: usize,
    count: usize,
    bytes: usize,
    count_json: &Json<'_>,
) -> Result<Strided<'a>, Fault> {
    let stride = view.stride.unwrap_or(bytes);
    if stride < bytes {
        return Err(
            count_json.fault(format!("elements of {bytes} bytes to fit a stride of {stride}"))
        );
    }
    let length = match count {
        0 => Some(0),
        _ => (count - 1).checked_mul(stride).and_then(|length| length.checked_add(bytes)),
    };
    let bytes = length.and_then(|length| slice(view.bytes, offset, length)).ok_or_else(|| {
        let size = view.bytes.len();
        let needed = length.map_or("more bytes than there are numbers".to_owned(), |length| {
            format!("{length} bytes")
        });
        count_json.fault(format!(
            "elements within the view of {size} bytes, from byte {offset} (so many need {needed})"
        ))
    })?;
    Ok(Strided { bytes, stride, in_file: view.in_file })
}
