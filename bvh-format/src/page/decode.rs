//! The scalar reference decoder of treelets.
//!
//! It follows section 8 of `spec/format.md` step by step, and it is the oracle for every vector backend.

use super::reader::Page;
use crate::profile::{Encoding, Profile};
use crate::quantize::{decode_max, decode_min, residual_unit};
use crate::slabs::{NodeSlabs, row};
use crate::treelet::{Child, CodePlaces};

/// Decodes the slabs of one child of a treelet. `parent` holds the decoded slabs of the treelet itself.
pub fn decode_child(
    profile: Profile,
    object_scale: f32,
    treelet: &[u8],
    child: usize,
    parent: &NodeSlabs,
) -> NodeSlabs {
    decode_slabs(profile, object_scale, treelet, child, parent, profile.directions().slabs())
}

/// Decodes the first `slabs` slabs of a child.
pub(crate) fn decode_slabs(
    profile: Profile,
    object_scale: f32,
    treelet: &[u8],
    child: usize,
    parent: &NodeSlabs,
    slabs: usize,
) -> NodeSlabs {
    let encoding = profile.encoding();
    let places = CodePlaces::new(profile, treelet, child);
    if slabs == MOST_SLABS
        && profile == Profile::Dop26U8Wide
        && let Some(treelet) = treelet.first_chunk()
    {
        return decode_in_lanes(treelet, child, parent);
    }
    let mut node = NodeSlabs::default();
    for slab in 0..slabs {
        let row = row(slab);
        if encoding == Encoding::F32 {
            (node.lo[row], node.hi[row]) = places.read_ends(treelet, slab);
            continue;
        }
        let (parent_lo, parent_hi) = (parent.lo[row], parent.hi[row]);
        let unit = residual_unit(encoding, parent_lo, parent_hi, object_scale);
        let (code_lo, code_hi) = places.read(treelet, slab);
        node.lo[row] = decode_min(encoding, code_lo, parent_lo, unit);
        node.hi[row] = decode_max(encoding, code_hi, parent_hi, unit);
    }
    node
}

/// The slabs of the largest set of directions, which fill the rows of a treelet but for row 7.
const MOST_SLABS: usize = 13;

/// Decodes the slabs of a child of Dop26U8Wide, all rows at a time, which compilers turn into vector code.
#[inline]
fn decode_in_lanes(treelet: &[u8; 128], child: usize, parent: &NodeSlabs) -> NodeSlabs {
    let rows = treelet.as_chunks::<4>().0;
    let (lo, hi) = rows.split_at(16);
    let (mut codes_lo, mut codes_hi) = ([0u8; 16], [0u8; 16]);
    for row in 0..16 {
        (codes_lo[row], codes_hi[row]) = (lo[row][child % 4], hi[row][child % 4]);
    }
    let mut node = NodeSlabs::default();
    for row in 0..16 {
        let (parent_lo, parent_hi) = (parent.lo[row], parent.hi[row]);
        let unit = residual_unit(Encoding::U8, parent_lo, parent_hi, 0.0);
        node.lo[row] = decode_min(Encoding::U8, codes_lo[row].into(), parent_lo, unit);
        node.hi[row] = decode_max(Encoding::U8, codes_hi[row].into(), parent_hi, unit);
    }
    // Rows that have no slab.
    for row in [7, 14, 15] {
        (node.lo[row], node.hi[row]) = (0.0, 0.0);
    }
    node
}

/// Decodes the slabs of all children in a checked page, parents before their children. Calls `visit` with the slot and the
/// number of each child, the slabs of its treelet, and its own.
///
/// # Errors
/// The first error of `visit`.
pub fn decode_page<E>(
    page: &Page,
    object_scale: f32,
    mut visit: impl FnMut(u8, usize, &NodeSlabs, &NodeSlabs) -> Result<(), E>,
) -> Result<(), E> {
    let header = page.header();
    let mut treelets: Vec<NodeSlabs> = (0..header.treelets)
        .map(|slot| if slot < header.roots { page.anchor_slabs(slot) } else { NodeSlabs::default() })
        .collect();
    for slot in 0..header.treelets {
        let (treelet, links, slabs) = (page.treelet(slot), page.links(slot), treelets[usize::from(slot)]);
        for child in 0..links.children() {
            let node = decode_child(page.profile(), object_scale, treelet, child, &slabs);
            visit(slot, child, &slabs, &node)?;
            if let Child::Treelet(below) = links.child(child) {
                treelets[usize::from(below)] = node;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdop::Kdop;
    use crate::treelet::SlabEncoder;
    use cbvh_testkit::Random;

    /// The k-DOPs of eight random point clouds, and of all their points.
    fn clouds(seed: u64) -> (Kdop, Vec<Kdop>) {
        let mut random = Random::new(seed);
        let mut random = || random.unit() as f32 - 0.5;
        let scale = 2f32.powi((seed % 60) as i32 - 30);
        let mut parent = Kdop::EMPTY;
        let children = (0..8)
            .map(|_| {
                let centre = [random(), random(), random()];
                let points = [(); 4].map(|()| centre.map(|c| (c + 0.1 * random()) * scale));
                let child = Kdop::of_points(points);
                parent.join(&child, 13);
                child
            })
            .collect();
        (parent, children)
    }

    #[test]
    fn all_rows_at_a_time_decode_as_one_slab_after_another() {
        let profile = Profile::Dop26U8Wide;
        let mut random = Random::new(5);
        for seed in 0..2000 {
            let mut treelet = [0; 128];
            treelet.iter_mut().for_each(|byte| *byte = random.bits() as u8);
            let (mut parent, _) = clouds(seed);
            if seed % 5 == 0 {
                parent.hi[3] = parent.lo[3];
            }
            let parent = NodeSlabs::from_kdop(&parent, 13);
            for child in 0..4 {
                let all = decode_child(profile, 1.0, &treelet, child, &parent);
                let mut singly = NodeSlabs::default();
                let places = CodePlaces::new(profile, &treelet, child);
                for slab in 0..13 {
                    let (row, codes) = (row(slab), places.read(&treelet, slab));
                    let unit = residual_unit(Encoding::U8, parent.lo[row], parent.hi[row], 1.0);
                    singly.lo[row] = decode_min(Encoding::U8, codes.0, parent.lo[row], unit);
                    singly.hi[row] = decode_max(Encoding::U8, codes.1, parent.hi[row], unit);
                }
                assert_eq!(all, singly);
                // Fewer slabs are decoded one after another.
                let three = decode_slabs(profile, 1.0, &treelet, child, &parent, 3);
                assert_eq!(
                    (three.lo[..3].to_vec(), three.hi[..3].to_vec()),
                    (all.lo[..3].to_vec(), all.hi[..3].to_vec())
                );
            }
        }
    }

    #[test]
    fn every_profile_decodes_to_slabs_that_contain_the_true_ones() {
        for profile in Profile::ALL {
            let slabs = profile.directions().slabs();
            for seed in 0..500 {
                let (parent, children) = clouds(seed);
                let parent = NodeSlabs::from_kdop(&parent, slabs);
                let scale = 2f32.powi((seed % 60) as i32 - 30 - 14);
                let mut treelet = vec![0; profile.treelet_bytes()];
                let children = &children[..profile.width()];
                let encoder = SlabEncoder::new(profile, scale, &parent);
                let numbered = children.iter().enumerate();
                numbered.for_each(|(index, child)| encoder.encode(index, child, &mut treelet));
                for (index, child) in children.iter().enumerate() {
                    let decoded = decode_child(profile, scale, &treelet, index, &parent);
                    assert!(decoded.to_kdop(slabs).contains(child, slabs), "{}", profile.name());
                }
            }
        }
    }
}
