//! The words of the page about layouts: what they are, how they were measured, and what the figures do not tell.

use crate::report::document::Settings;

/// What the page is about.
pub(super) const ABOUT: &str = "\
A layout is how a <code>.cbvh</code> file stores bounding volumes (its profile) and triangles (their encoding). This page \
tells for each pair of meshes how fast every layout answers, how many bytes it takes, and how far its distances are from \
the exact ones.";

/// What is known if no answer is wrong.
pub(super) const RIGHT: &str = "\
All answers are right: layouts that store the same triangles agree about contact, and about distances to the last bit. \
Distances with an allowed error were within it.";

/// Says how it was measured and what the figures do not tell.
pub(super) fn methods(settings: &Settings) -> String {
    let rounds = settings.rounds;
    format!(
        "<h2 id=\"methods\">How it was measured</h2>\n<ul>\n\
         <li><strong>Times</strong> are those of single queries on one thread that is bound to one processor. All \
         layouts take turns in each of {rounds} rounds, with three untimed queries before each turn, so caches hold \
         what earlier queries left there. A median is taken over the poses of a round and then over the rounds. Nine \
         tenths of the poses take less than the 90 % time.</li>\n\
         <li><strong>The order of the tables</strong> is by the geometric mean of the median times for contact and \
         for distance. A dot marks layouts that no other one beats in both time and bytes.</li>\n\
         <li><strong>Errors</strong> are relative to the exact distance of the mesh, over the poses in which the \
         meshes are apart. Layouts without loss give that distance exactly unless an error is allowed. The errors in \
         the tables are those found; other poses may come closer to what is allowed.</li>\n\
         <li><strong>Quantised triangles</strong> have moved by up to the length in the table, 1e-5 of the mesh's \
         diagonal by default. Near contact this is a large part of the distance.</li>\n\
         <li><strong>Node tests</strong> compare up to 16 pairs of bounding volumes at once, <strong>packet \
         tests</strong> up to 16 pairs of triangles; what these cannot decide goes to <strong>exact tests</strong> of \
         one pair of triangles each.</li>\n</ul>\n\
         <h2 id=\"limits\">What the figures do not tell</h2>\n<ul>\n\
         <li>They compare layouts on one machine on one day. On a virtual machine neighbours share the last cache and \
         the memory.</li>\n\
         <li>A median hides what single poses cost, and it depends on the mix of poses near contact and far \
         apart.</li>\n\
         <li>Files that are not in memory yet take longer to answer first: see <code>cbvh query --cold</code>.</li>\n\
         </ul>\n"
    )
}
