//! The page of an assembly: all parts where they stand, and the clashes in their order.

use super::found::Found;
use super::of_file;
use super::parts::{Assembly, Part};
use crate::console::Failure;
use crate::view::output::name_of;
use cbvh_view::{Named, Page, Placed, PlacedClash};

/// Returns the page. Parts whose meshes are one file share it.
pub(super) fn page(assembly: &Assembly, found: &[Found<'_>]) -> Result<Page, Failure> {
    let placed = |part: &Part| {
        let shape = part.shape.opened().map_err(|error| of_file(&error))?;
        let of = Named { name: name_of(&part.file), path: part.file.display().to_string(), shape };
        let mut placed = Placed::new(&part.name, of, part.world);
        (placed.margin, placed.groups) = (part.margin, part.groups);
        Ok(placed)
    };
    let placed = assembly.parts.iter().map(placed).collect::<Result<Vec<_>, Failure>>()?;
    let clashes: Vec<PlacedClash> = found.iter().map(clash).collect();
    Page::clashes(placed, &clashes).map_err(Failure::from_page)
}

fn clash(of: &Found<'_>) -> PlacedClash {
    let mut clash = PlacedClash::new(of.parts, of.class, of.point);
    (clash.depth, clash.distance, clash.translation) = (of.depth, of.distance, of.translation);
    clash.volume = of.shared.map(|shared| shared.volume);
    clash.pierced = of.shared.map_or([None; 2], |shared| [shared.pierced_a, shared.pierced_b]);
    clash
}
