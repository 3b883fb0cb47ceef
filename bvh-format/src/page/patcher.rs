//! Changes the numbers in a page after it has been written: its own place, its parents, and the targets of its links.
//!
//! A baker writes a page before it knows how many pages, lines, words and packets will come before it. The numbers in
//! such a page count from the first page that was written together with it. When the order of the file is known, a
//! patcher writes the final numbers and then seals the page with its checksum.

use super::writer::{write_header, write_parent, write_remote};
use super::{PAGE, Page, PagePlace, RootRef, page_checksum};
use crate::profile::Profile;

/// A page that has been written by a [`PageWriter`](super::PageWriter) and now gets its final numbers.
///
/// ```
/// use bvh_format::kdop::Kdop;
/// use bvh_format::leaf::TriangleEncoding;
/// use bvh_format::page::{PagePatcher, PagePlace, PageShape, PageWriter, TightBound, WrittenPage};
/// use bvh_format::profile::Profile;
/// use bvh_format::vertex::Vertices;
///
/// let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let kdop = Kdop::of_points(triangle);
/// let shape = PageShape { roots: 1, remotes: 0, treelets: 1, short: 0 };
/// let mut writer = PageWriter::new(Profile::Dop14U8, 1.0, shape);
/// writer.root(&kdop, None);
/// writer.begin_treelet();
/// writer.leaf(&TightBound::of_kdop(kdop), [(triangle, 7)].into_iter()); // its id is 7
/// let WrittenPage { mut bytes, leaf_block, .. } =
///     writer.finish(TriangleEncoding::F32, &Vertices::around([0.0; 3]), true);
/// assert_eq!(leaf_block.len() % 64, 0);
///
/// let mut patcher = PagePatcher::new(&mut bytes, Profile::Dop14U8);
/// let place = PagePlace { page: 3, leaf_line: 40, id_word: 9, first_packet: 20 };
/// patcher.set_place(&place);
/// assert_eq!(place.behind(patcher.page().header()).first_packet, 21);
/// patcher.seal();
/// ```
pub struct PagePatcher<'a> {
    bytes: &'a mut [u8; PAGE],
    profile: Profile,
}

impl<'a> PagePatcher<'a> {
    /// Opens a page of an object of this profile.
    pub fn new(bytes: &'a mut [u8; PAGE], profile: Profile) -> Self {
        Self { bytes, profile }
    }

    /// The page as it is now.
    pub fn page(&self) -> Page<'_> {
        Page::new(self.bytes, self.profile)
    }

    /// States where the page and its blocks stand. A page without ids keeps 0 as the place of its id block.
    pub fn set_place(&mut self, place: &PagePlace) {
        let mut header = *self.page().header();
        header.page_number = place.page.into();
        header.leaf_line = place.leaf_line.into();
        header.id_word = if header.id_words.get() == 0 { 0 } else { place.id_word }.into();
        header.first_packet = place.first_packet.into();
        write_header(self.bytes, &header);
    }

    /// States which remote link of which page leads to a root.
    pub fn set_parent(&mut self, root: u8, page: u32, link: u8) {
        write_parent(self.bytes, self.profile, root.into(), (page, link));
    }

    /// Changes the root to which a remote link leads.
    pub fn set_remote(&mut self, link: u8, to: RootRef) {
        let roots = self.page().header().roots;
        write_remote(self.bytes, self.profile, roots, link, to);
    }

    /// Puts in the checksum of the page. No change may follow.
    pub fn seal(self) {
        let mut header = *self.page().header();
        header.checksum = page_checksum(self.bytes).into();
        write_header(self.bytes, &header);
    }
}
