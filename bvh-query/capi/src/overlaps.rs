//! Where and how deep two meshes overlap, how far apart they are if they do not, and where a mesh meets itself. These questions
//! use one core.

use crate::entry::entry;
use crate::input::{self, each};
use crate::output::{List, Lists, Room};
use crate::pairs::{Least, Question};
use crate::queriers;
use crate::status::Failure;
use crate::types::{
    ClashChoices, ClashRow, IntersectionRow, MeasuredClashRow, MeshHandle, PatchChoices, PatchCounts,
    PatchRow, PenetrationChoices, PenetrationRow, PointRow, PoseRows, QuerierHandle, RegionRow,
    SelfContactRow, SeparationRow, SignedDistanceRow,
};
use bvh_query::{Pose, Querier, QueryError, Shape};

impl Question {
    /// Asks about each pose and its number, and writes an answer for each.
    ///
    /// # Safety
    /// As for `Question::ask` and `Room::new`.
    unsafe fn each_on_one_core<T: Into<R>, R: Copy>(
        &self,
        answers: *mut R,
        one: impl Fn(&mut Querier, [Shape<'_>; 2], (usize, &Pose)) -> Result<T, Failure>,
    ) -> Result<(), Failure> {
        // SAFETY: the caller vouches for it.
        unsafe {
            self.ask(|querier, _, meshes, poses| {
                let mut room = Room::new("answers", answers, poses.len())?;
                room.fill(poses.iter().enumerate().map(|pose| one(querier, meshes, pose)), T::into)
            })
        }
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_separations(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    directions: *const f64,
    count: usize,
    answers: *mut SeparationRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it; three numbers in an array are aligned as one is.
    entry(|| unsafe {
        let mut read = Vec::new();
        let directions =
            each("directions", directions.cast(), count, &mut read, |direction: &[f64; 3]| Ok(*direction))?;
        question.each_on_one_core(answers, |querier, [a, b], (number, pose)| {
            querier.separation(a, b, pose, directions[number]).map_err(|error| match error {
                QueryError::Number(_) => Failure::from(error).at(format_args!("directions[{number}]")),
                _ => error.into(),
            })
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_penetrations(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const PenetrationChoices,
    answers: *mut PenetrationRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        question.each_on_one_core(answers, |querier, [a, b], (_, pose)| {
            Ok(querier.penetration(a, b, pose, &options)?)
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_signed_distances(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const PenetrationChoices,
    answers: *mut SignedDistanceRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        question.each_on_one_core(answers, |querier, [a, b], (_, pose)| {
            Ok(querier.signed_distance(a, b, pose, &options)?)
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_clashes(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const ClashChoices,
    answers: *mut ClashRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read();
        question
            .each_on_one_core(answers, |querier, [a, b], (_, pose)| Ok(querier.clash(a, b, pose, &options)?))
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_measured_clashes(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    options: *const ClashChoices,
    answers: *mut MeasuredClashRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        let options = input::options("options", options)?.read().magnitudes(true);
        question
            .each_on_one_core(answers, |querier, [a, b], (_, pose)| Ok(querier.clash(a, b, pose, &options)?))
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_intersections(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    count: usize,
    answers: *mut IntersectionRow,
) -> i32 {
    let question = Question { querier, a, b, poses, count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.each_on_one_core(answers, |querier, [a, b], (_, pose)| Ok(querier.intersection(a, b, pose)?))
    })
}

/// Returns a number of contacts, which may be more than there is room for in memory.
fn counted(total: u64) -> usize {
    total.try_into().unwrap_or(usize::MAX)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_contact_regions(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    pose_count: usize,
    counts: *mut usize,
    regions: *mut RegionRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    let question = Question { querier, a, b, poses, count: pose_count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.ask(|querier, _, [a, b], poses| {
            let mut lists = Lists::new(("regions", regions, capacity, count), counts, poses.len())?;
            for (number, pose) in poses.iter().enumerate() {
                let found = querier.contact_regions(a, b, pose, lists.room())?;
                lists.add(number, found.regions, counted(found.total));
            }
            lists.finish()
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_patches(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    pose_count: usize,
    options: *const PatchChoices,
    counts: *mut PatchCounts,
    patches: *mut PatchRow,
    capacity: usize,
    count: *mut usize,
    regions: *mut RegionRow,
    region_capacity: usize,
    region_count: *mut usize,
) -> i32 {
    let question = Question { querier, a, b, poses, count: pose_count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.ask(|querier, _, [a, b], poses| {
            let options = input::options("options", options)?.read();
            let mut counts = Room::new("counts", counts, if counts.is_null() { 0 } else { poses.len() })?;
            let mut list = List::new("patches", patches, capacity, count)?;
            let wants_regions = !region_count.is_null();
            let list_of_regions = || List::new("regions", regions, region_capacity, region_count);
            let mut list_of_regions = wants_regions.then(list_of_regions).transpose()?;
            let mut before = 0;
            for (number, pose) in poses.iter().enumerate() {
                let found = querier.patches(a, b, pose, &options)?;
                let (patches, contacts) = (found.patches.len(), found.regions.len());
                counts.set(number, PatchCounts { patches, contacts, total: counted(found.total) });
                list.add(found.patches.into_iter().map(|mut patch| {
                    patch.first += before;
                    patch
                }));
                if let Some(list) = &mut list_of_regions {
                    list.add(found.regions);
                }
                before += contacts;
            }
            // Both say how many there are, also where the other one has too little room.
            let finished = list_of_regions.map_or(Ok(()), List::finish);
            list.finish().and(finished)
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_contact_points(
    querier: QuerierHandle,
    a: MeshHandle,
    b: MeshHandle,
    poses: *const PoseRows,
    pose_count: usize,
    options: *const PatchChoices,
    counts: *mut usize,
    points: *mut PointRow,
    capacity: usize,
    count: *mut usize,
    patches: *mut PatchRow,
    patch_capacity: usize,
    patch_count: *mut usize,
) -> i32 {
    let question = Question { querier, a, b, poses, count: pose_count };
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        question.ask(|querier, _, [a, b], poses| {
            let options = input::options("options", options)?.read_with_points();
            let mut counts = Room::new("counts", counts, if counts.is_null() { 0 } else { poses.len() })?;
            let mut list = List::new("points", points, capacity, count)?;
            let wants_patches = !patch_count.is_null();
            let list_of_patches = || List::new("patches", patches, patch_capacity, patch_count);
            let mut list_of_patches = wants_patches.then(list_of_patches).transpose()?;
            // Those of earlier poses.
            let (mut patches_before, mut contacts_before) = (0, 0);
            for (number, pose) in poses.iter().enumerate() {
                let found = querier.patches(a, b, pose, &options)?;
                counts.set(number, found.points.len());
                for (patch, of) in found.patches.iter().enumerate() {
                    let points = &found.points[of.first_point..][..of.point_count];
                    list.add(points.iter().map(|point| PointRow::new(patches_before + patch, point)));
                }
                patches_before += found.patches.len();
                if let Some(list) = &mut list_of_patches {
                    list.add(found.patches.into_iter().map(|mut patch| {
                        patch.first += contacts_before;
                        patch
                    }));
                }
                contacts_before += found.regions.len();
            }
            // Both say how many there are, also where the other one has too little room.
            let finished = list_of_patches.map_or(Ok(()), List::finish);
            list.finish().and(finished)
        })
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_self_contacts(
    querier: QuerierHandle,
    mesh: MeshHandle,
    contacts: *mut SelfContactRow,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe {
        queriers::with(querier, |asker| {
            let shape = asker.at_hand.one("mesh", mesh)?;
            let mut lists = Lists::new(("contacts", contacts, capacity, count), std::ptr::null_mut(), 1)?;
            let mut least = Least::new(lists.room());
            let visited = asker.querier.visit_self_contacts(shape, |contact| least.add(contact));
            least.check()?;
            visited?;
            let (found, count) = least.finish();
            lists.add(0, found, count);
            lists.finish()
        })
    })
}
