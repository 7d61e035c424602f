//! Rays as a host keeps them, for functions that a host's own code can call back.
//!
//! A [kernel](crate::Kernel) for a record is a C function of one argument too, but the argument is a struct of the host's: the
//! record says where in it the rays, their mask and the instance's data are found. It does one packet, of as many
//! rays as the kernel is wide, and needs none of the tables that a [call](crate::abi) leads to.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{PlaceId, PlaceKind};

use crate::Shape;
use crate::kernel::{Kernel, OpKind, Region};

/// How a host keeps a packet of rays, and how it asks about them. Offsets are bytes of the function's argument.
///
/// Rays are rows of one word a ray: row `r` of ray `i` is the word `r * width + i`, where `width` is the number of rays.
/// Rows are 4-byte aligned; those of state components hold floats.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RayRecord {
    /// Where the address of the first row stands.
    pub rays: u32,
    /// Where the address of the mask stands: a word a ray, 0 for those that are left out. All rays take part where `None`.
    pub mask: Option<u32>,
    /// Where the address of the block of the first instance stands. Blocks are 8-byte aligned and lie one after the other.
    pub instances: u32,
    /// Where the number of the instance stands, a u32; the first one's where `None`.
    pub number: Option<u32>,
    /// The row of each state component that the record has.
    pub rows: BTreeMap<u32, u32>,
    /// What else is written for rays with a hit.
    pub marks: Vec<Mark>,
}

/// A word that is written to a row, for rays with a hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Mark {
    /// The row.
    pub row: u32,
    /// What is written.
    pub word: MarkWord,
}

/// A word that the caller gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MarkWord {
    /// Always these bits.
    Constant(u32),
    /// What stands there in the argument.
    Argument(u32),
    /// What stands so many bytes behind the address that stands there in the argument.
    Behind {
        /// Where the address stands.
        pointer: u32,
        /// How many bytes.
        offset: u32,
    },
}

/// Why a kernel can't be called for a record.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// It is of another shape, or of a method that accepts no hits.
    #[error("records are for packets of rays that may hit something")]
    Shape,
    /// It reads or sets what the record has no row for.
    #[error("the record has no row for a component of `{0}`")]
    NoRow(String),
    /// It reads or sets scratch, or takes members of objects.
    #[error("records have no place for `{0}`")]
    NoPlace(String),
    /// It asks for rays, light or random numbers.
    #[error("it asks its host for something, and a record says nothing of a host")]
    AsksHost,
}

impl RayRecord {
    /// Whether all that the kernel reads and sets is here.
    ///
    /// # Errors
    /// See [`RecordError`].
    pub fn check(&self, kernel: &Kernel) -> Result<(), RecordError> {
        if kernel.shape != Shape::Packet || kernel.accepted_output().is_none() {
            return Err(RecordError::Shape);
        }
        for id in used_places(kernel) {
            let place = kernel.place(id);
            let name = || place.place.name.clone();
            let mut components = place.location..place.location + place.place.len;
            match place.place.kind {
                PlaceKind::State if !components.all(|it| self.rows.contains_key(&it)) => {
                    return Err(RecordError::NoRow(name()));
                }
                PlaceKind::Scratch => return Err(RecordError::NoPlace(name())),
                _ if place.of_objects => return Err(RecordError::NoPlace(name())),
                _ => {}
            }
        }
        if asks_host(&kernel.prologue) || asks_host(&kernel.body) {
            return Err(RecordError::AsksHost);
        }
        Ok(())
    }
}

fn used_places(kernel: &Kernel) -> BTreeSet<PlaceId> {
    let mut used = kernel.outputs.iter().map(|output| output.place).collect();
    add_used_places(&kernel.prologue, &mut used);
    add_used_places(&kernel.body, &mut used);
    used
}

fn add_used_places(region: &Region, used: &mut BTreeSet<PlaceId>) {
    for op in &region.ops {
        if let OpKind::Load(place, _) | OpKind::Store { place, .. } | OpKind::Length(place) =
            op.kind
        {
            used.insert(place);
        }
        op.kind.regions().for_each(|region| add_used_places(region, used));
    }
}

fn asks_host(region: &Region) -> bool {
    region.ops.iter().any(|op| match &op.kind {
        OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightCount
        | OpKind::LightSample { .. }
        | OpKind::Ambient
        | OpKind::Rand(_) => true,
        kind => kind.regions().any(asks_host),
    })
}

#[cfg(test)]
mod tests {
    use rtsl_ir::Function;

    use super::*;
    use crate::Layout;

    fn record(rows: &[u32]) -> RayRecord {
        let rows = rows.iter().map(|component| (*component, *component)).collect();
        RayRecord { rays: 0, mask: None, instances: 8, number: None, rows, marks: Vec::new() }
    }

    fn check(text: &str, shape: Shape) -> Result<(), RecordError> {
        let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
        let mut layout = Layout::default();
        layout.scratch.insert("s".to_owned(), 0);
        let kernel = crate::lower(&function, &layout, shape, 4).unwrap();
        let distance = rtsl_spec::lookup_state("rt_HitDistance").unwrap().first_component;
        record(&[distance]).check(&kernel)
    }

    const HIT: &str =
        "function f state rt_HitDistance: f32[1] scratch s: f32[1] accepted a: bool[1] {
        %t: f32 = load state:rt_HitDistance@0 %c: bool = less %t, %t ";

    #[test]
    fn what_has_rows_and_asks_nobody_fits() {
        let hit = format!("{HIT} return accepted:a@0 = %c, state:rt_HitDistance@0 = %t }}");
        assert_eq!(check(&hit, Shape::Packet), Ok(()));
        assert_eq!(check(&hit, Shape::Stream), Err(RecordError::Shape));
        let none = format!("{HIT} return state:rt_HitDistance@0 = %t }}");
        assert_eq!(check(&none, Shape::Packet), Err(RecordError::Shape));
        let scratch = format!("{HIT} return accepted:a@0 = %c, scratch:s@0 = %t }}");
        assert_eq!(check(&scratch, Shape::Packet), Err(RecordError::NoPlace("s".to_owned())));
        let asks = format!(
            "{HIT} %r: f32 = rand return accepted:a@0 = %c, state:rt_HitDistance@0 = %r }}"
        );
        assert_eq!(check(&asks, Shape::Packet), Err(RecordError::AsksHost));
        let other = HIT.replace("rt_HitDistance", "rt_Epsilon");
        let other = format!("{other} return accepted:a@0 = %c }}");
        let row = RecordError::NoRow("rt_Epsilon".to_owned());
        assert_eq!(check(&other, Shape::Packet), Err(row));
    }
}
