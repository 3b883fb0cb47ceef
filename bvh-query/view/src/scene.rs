//! The page of a scene of the query library.

use crate::PageError;
use crate::files::Named;
use crate::page::{Page, Placed, refuse_frames};
use bvh_query::{InstanceId, Pose, Scene, ScenePair};
use std::collections::HashMap;
use std::fmt::Display;

/// Which instances of a scene move, and how.
///
/// [`Page::of_scene`] has an example.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// The instances that move.
    pub moving: Vec<InstanceId>,
    /// In each frame, the poses of these instances, in the same order.
    pub poses: Vec<Vec<Pose>>,
}

impl Page {
    /// Shows a scene as it is, and frames of those instances that move. `file_of` gives the name and the path of the file of an
    /// instance, and `number_of` the number after the `#` that an instance without a name is called.
    ///
    /// ```
    /// use bvh_query::{Pose, Scene};
    /// use cbvh_view::{Frames, Page};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let mut scene = Scene::new()?;
    /// scene.add(block.clone(), at(0.0)?)?;
    /// let right = scene.add_named("right", block, at(3.0)?)?;
    /// let frames = Frames { moving: vec![right], poses: vec![vec![at(3.0)?], vec![at(2.0)?]] };
    /// let file_of = |_| ("block".to_owned(), "block.cbvh".to_owned());
    /// let page = Page::of_scene(&scene, &frames, file_of, |id| id.to_bits())?;
    /// # page.write(&mut std::io::sink())?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Page::scene`]; [`PageError::NotInScene`] if what moves is not in the scene; [`PageError::Shape`] if the file
    /// of a shape is no longer there.
    pub fn of_scene<N: Display>(
        scene: &Scene,
        frames: &Frames,
        file_of: impl Fn(InstanceId) -> (String, String),
        number_of: impl Fn(InstanceId) -> N,
    ) -> Result<Self, PageError> {
        for &id in &frames.moving {
            scene.pose(id)?;
        }
        refuse_frames(&frames.poses, frames.moving.len())?;
        let ids: Vec<InstanceId> = scene.instances().collect();
        let places: HashMap<InstanceId, usize> = ids.iter().copied().zip(0..).collect();
        // The place of each moving instance in a frame, in the order of the instances. The first counts if it is named twice.
        let mut moving: Vec<(InstanceId, usize)> = frames.moving.iter().copied().zip(0..).collect();
        moving.sort_unstable();
        moving.dedup_by_key(|(id, _)| *id);
        let mut placed = Vec::with_capacity(ids.len());
        for &id in &ids {
            let (name, path) = file_of(id);
            placed.push(Placed {
                name: scene.name(id)?.map_or_else(|| format!("#{}", number_of(id)), str::to_owned),
                of: Named { name, path, shape: scene.shape(id)?.opened()? },
                pose: *scene.pose(id)?,
                margin: scene.margin(id)?,
                groups: scene.groups(id)?,
                moving: moving.binary_search_by_key(&id, |(id, _)| *id).is_ok(),
            });
        }
        let pair = |ScenePair { a, b, .. }: ScenePair| Some([*places.get(&a)?, *places.get(&b)?]);
        let allowed = scene.allowed().filter_map(pair).collect();
        let margins = scene.pair_margins().filter_map(|(of, margin)| Some((pair(of)?, margin))).collect();
        let in_order =
            |poses: &Vec<Pose>| moving.iter().filter_map(|&(_, at)| poses.get(at).copied()).collect();
        let frames = frames.poses.iter().map(in_order).collect();
        Self::scene(placed, allowed, margins, frames)
    }
}
