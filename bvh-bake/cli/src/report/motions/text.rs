//! The words of the page about motions: what samples are, how they were measured, and what the figures do not tell.

use super::asked::MAX_SECONDS;
use crate::report::document::Settings;

/// What the page is about.
pub(super) const ABOUT: &str = "\
Whether the way of a moving mesh is free is often asked by samples: poses along the way, of which the first that touches \
ends the question. Samples miss contacts between them, and find others late. cbvh certifies its answers for every moment \
between start and end. This page tells for each pair of meshes what samples miss, how late they are, and how long they \
take beside the certified answers.";

/// What is known if no answer is wrong.
pub(super) const RIGHT: &str = "\
No answer contradicts another: no sample touches where a motion is certified free, or before the time until which it is.";

/// Says how it was measured and what the figures do not tell.
pub(super) fn methods(settings: &Settings) -> String {
    let rounds = settings.rounds;
    format!(
        "<h2 id=\"methods\">How it was measured</h2>\n<ul>\n\
         <li><strong>Samples</strong> are equally spaced poses with both ends, asked about with \
         <code>Querier::collide</code> until one touches. A spread order asks about both ends and then in van der \
         Corput's order: halves, quarters, and so on. It finds some contact sooner, but not the first one.</li>\n\
         <li><strong>Certified answers</strong> are those of <code>Querier::motion</code>, which finds the first contact, \
         and of <code>Querier::is_free</code>, which looks for any. Both may leave a motion undecided that comes nearer \
         than a millionth of the larger mesh's diagonal without a contact.</li>\n\
         <li><strong>Missed</strong> is a certified contact where all samples are free. <strong>Late</strong> is the time \
         between the moment until which the way is certified free and the contact found, as a fraction of the way, \
         over the contacts that are not missed. Where it is much more than the time between two samples, they have \
         missed the first contact and found a later one. For the certified first contact it is the time between the two \
         moments that its answer names.</li>\n\
         <li><strong>Times</strong> are those of single motions on one thread that is bound to one processor, with the \
         poses of samples made on the way. All ways to ask take turns in each of {rounds} rounds, with three untimed \
         motions before each turn. Those that take long take part in as many rounds as fit into {MAX_SECONDS} seconds \
         per pair, but at least in one; <code>report.csv</code> has their number. A median is taken over the motions of \
         a round and then over the rounds. Nine tenths of the motions take less than the 90 % time.</li>\n</ul>\n\
         <h2 id=\"limits\">What the figures do not tell</h2>\n<ul>\n\
         <li>What samples miss depends on the motions: other ones need more samples, or fewer. The motions asked about \
         say nothing of others.</li>\n\
         <li>A median hides what single motions cost, and it depends on how many of them hit, and how soon.</li>\n\
         <li>They are of one machine on one day. On a virtual machine neighbours share the last cache and the \
         memory.</li>\n</ul>\n"
    )
}
