//! What a file states about its surfaces: whether an object is closed, where its components are, and how often
//! triangles count whose duplicates were left out.
//!
//! The section is checked when it is first needed. A triangle is named there by its place, which counts the lanes of all
//! packets of the object; pages are searched for it by the number of their first packet.

use crate::error::{NumberError, QueryError};
use crate::file::bvh::Bvh;
use crate::file::place::TrianglePlace;
use bvh_format::leaf::PACKET;
use bvh_format::object::Object;
use bvh_format::topology::{Net, ObjectTopology};
use bvh_format::treelet::{Child, Links};
use bvh_format::{FormatError, Rule};

/// What a file states about the surface of an object. The lists are read in place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Topology<'a> {
    /// Whether the triangles have no boundary, each counted as often as its net says.
    pub(crate) closed: bool,
    of_object: &'a ObjectTopology,
    bytes: &'a [u8],
    /// The nets that are not 1, by ascending places.
    nets: &'a [Net],
}

impl<'a> Topology<'a> {
    /// Returns the places of a triangle of each component, ascending. There are none if each triangle counts as a
    /// component.
    pub(crate) fn components(&self) -> impl ExactSizeIterator<Item = u32> + use<'a> {
        self.of_object.components(self.bytes).iter().map(|place| place.get())
    }

    /// Returns whether each stored triangle counts once, in its own orientation.
    pub(crate) fn counts_each_once(&self) -> bool {
        self.nets.is_empty()
    }

    /// Returns the net of a stored triangle: how many equal triangles of the input have its
    /// orientation, itself included, less the number of those that have the opposite one.
    ///
    /// Cost: a binary search among the triangles whose net is not 1.
    #[inline]
    pub(crate) fn net(&self, place: u32) -> i32 {
        let found = self.nets.binary_search_by_key(&place, |net| net.place.get());
        found.map_or(1, |number| self.nets[number].net.get())
    }
}

impl Bvh {
    /// Returns whether an object is closed: whether its triangles traverse each edge as often in one direction as in
    /// the other, as on the surface of a solid. Points that do not lie on a closed surface are inside or outside of it.
    /// Exact duplicates count, with their orientation.
    ///
    /// Cost: at the first call for a file, one pass over its topology section; then none.
    ///
    /// # Errors
    /// [`QueryError::NoTopology`] if the file was baked without topology, [`QueryError::Damaged`] if its topology
    /// breaks a rule, and [`QueryError::Number`] if there is no such object.
    pub fn is_closed(&self, object: usize) -> Result<bool, QueryError> {
        Ok(self.topology(object)?.closed)
    }

    /// Returns the topology of an object.
    ///
    /// # Errors
    /// The errors of [`Bvh::is_closed`].
    pub(crate) fn topology(&self, object: usize) -> Result<Topology<'_>, QueryError> {
        let check = || self.layout().check_topology(self.bytes()).map(Vec::into_boxed_slice);
        let all = self.known_topology().get_or_init(check).as_deref().map_err(Clone::clone)?;
        if all.is_empty() {
            return Err(QueryError::NoTopology);
        }
        let of_object: &ObjectTopology = all.get(object).ok_or(NumberError::Object(object))?;
        Ok(Topology {
            closed: of_object.closed,
            of_object,
            bytes: self.bytes(),
            nets: of_object.nets(self.bytes()),
        })
    }

    /// Returns where the triangle at a place of the object is stored.
    ///
    /// Cost: a binary search among the pages of the object, which checks those that it touches first.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if there is no triangle at the place, or a page on the way breaks a rule.
    pub(crate) fn triangle_place(&self, object: &Object, place: u32) -> Result<TrianglePlace, QueryError> {
        let (number, lane) = (place / PACKET as u32, (place % PACKET as u32) as u8);
        // The last page whose first packet is not beyond: an earlier one with the same first packet has no packets.
        let pages = object.pages();
        let (mut low, mut high) = (pages.start, pages.end);
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            let first = self.page(object, middle)?.header().first_packet.get();
            (low, high) = if first <= number { (middle, high) } else { (low, middle) };
        }
        let page = self.page(object, low)?;
        let packet = number.checked_sub(page.header().first_packet.get());
        let packet = packet.and_then(|packet| u16::try_from(packet).ok());
        let triangles = packet.and_then(|packet| {
            let mut slots = 0..page.header().treelets;
            slots.find_map(|slot| triangles_of(&page.links(slot), packet))
        });
        match packet.filter(|_| triangles.is_some_and(|triangles| lane < triangles)) {
            Some(packet) => Ok(TrianglePlace { page: low, packet, lane }),
            None => {
                let at = self.layout().page_offset(low);
                Err(FormatError::new(Rule::TopologyPlace, at, "the place of a triangle", place).into())
            }
        }
    }

    /// Returns the place in its object of a stored triangle: the inverse of [`Bvh::triangle_place`].
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if the page breaks a rule.
    #[inline]
    pub(crate) fn place_of(&self, object: &Object, stored: TrianglePlace) -> Result<u32, QueryError> {
        let first = self.page(object, stored.page)?.header().first_packet.get();
        let packet = first.wrapping_add(u32::from(stored.packet));
        Ok(packet.wrapping_mul(PACKET as u32).wrapping_add(u32::from(stored.lane)))
    }
}

/// Returns the number of triangles of a packet of a page, if a treelet links to it.
fn triangles_of(links: &Links, packet: u16) -> Option<u8> {
    (0..8).find_map(|child| match links.child(child) {
        Child::Leaf { packet: found, triangles } if found == packet => Some(triangles),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, to_bytes};
    use bvh_format::Layout;
    use bvh_format::page::{PagePatcher, PagePlace};
    use bvh_format::validate::packets;

    /// A grid of cells with a wall between neighbours, which is given once for each of them.
    fn cells(count: u32) -> Mesh {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for x in 0..=count {
            let at = f64::from(x);
            positions.extend([[at, 0.0, 0.0], [at, 1.0, 0.0], [at, 0.0, 1.0]]);
        }
        for x in 0..count {
            let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|corner| 3 * x + corner);
            triangles.extend([[a, c, b], [d, e, f]]);
            for [p, q, r, s] in [[a, b, e, d], [b, c, f, e], [c, a, d, f]] {
                triangles.extend([[p, q, r], [p, r, s]]);
            }
        }
        Mesh::from_triangles(positions, triangles)
    }

    fn baked(mesh: &Mesh, options: &Options) -> Bvh {
        Bvh::from_bytes(to_bytes(mesh, options).unwrap().0).unwrap()
    }

    #[test]
    fn each_triangle_is_found_at_its_place_and_nowhere_else() {
        let bvh = baked(&cells(500), &Options::default());
        let object = &bvh.objects()[0];
        assert!(object.pages().len() > 10);
        let mut places = std::collections::BTreeSet::new();
        for number in object.pages() {
            let page = bvh.page(object, number).unwrap();
            for (packet, count) in packets(&page) {
                for lane in 0..count as u8 {
                    let stored = TrianglePlace { page: number, packet, lane };
                    let place = bvh.place_of(object, stored).unwrap();
                    assert_eq!(bvh.triangle_place(object, place), Ok(stored));
                    places.insert(place);
                }
            }
        }
        assert_eq!(places.len() as u64, object.triangles());
        let packets = object.record().packets.get() as u32;
        for place in (0..4 * packets + 40).chain([u32::MAX]).filter(|place| !places.contains(place)) {
            let QueryError::Damaged(error) = bvh.triangle_place(object, place).unwrap_err() else { panic!() };
            assert_eq!(error.rule, Rule::TopologyPlace);
        }
        let topology = bvh.topology(0).unwrap();
        assert!(topology.closed && topology.components().all(|place| places.contains(&place)));
        let nets: Vec<i32> = places.iter().map(|&place| topology.net(place)).collect();
        assert_eq!(nets.iter().filter(|&&net| net == 0).count(), 499);
        assert_eq!(nets.iter().sum::<i32>(), 500 * 8 - 2 * 499);
    }

    #[test]
    fn what_a_file_does_not_state_is_an_error() {
        let without = baked(&cells(3), &Options::default().topology(false));
        let error = without.is_closed(0).unwrap_err();
        assert_eq!(error, QueryError::NoTopology);
        assert!(error.to_string().contains("bake it again with topology"), "{error}");
        let with = baked(&cells(3), &Options::default());
        assert_eq!(with.is_closed(0), Ok(true));
        assert!(matches!(with.is_closed(1), Err(QueryError::Number(NumberError::Object(1)))));
    }

    /// Any first packets of pages lead to an error or a triangle, and never to a panic.
    #[test]
    fn forged_first_packets_are_survived() {
        let (sound, _) = to_bytes(&cells(200), &Options::default()).unwrap();
        let layout = Layout::read(&sound).unwrap();
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            (state >> 32) as u32 >> (state >> 27 & 31)
        };
        for _ in 0..200 {
            let mut bytes = sound.clone();
            for number in layout.objects[0].pages() {
                let at = layout.page_offset(number) as usize;
                let mut page =
                    PagePatcher::new(bytes[at..].first_chunk_mut().unwrap(), layout.objects[0].profile());
                let header = *page.page().header();
                page.set_place(&PagePlace {
                    page: number,
                    leaf_line: header.leaf_line.get(),
                    id_word: header.id_word.get(),
                    first_packet: random(),
                });
                page.seal();
            }
            let bvh = Bvh::from_bytes(bytes).unwrap();
            let object = &bvh.objects()[0];
            for _ in 0..100 {
                let place = random();
                match bvh.triangle_place(object, place) {
                    Ok(stored) => assert_eq!(bvh.place_of(object, stored), Ok(place)),
                    Err(error) => assert!(error.to_string().contains("R46"), "{error}"),
                }
            }
        }
    }
}
