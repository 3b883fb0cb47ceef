//! The relation of two meshes: whether they touch and, if not, whether one is inside the other.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::TrianglePlace;
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::bounding_volumes::surely_apart;
use crate::query::exact::stored_at;
use crate::query::probe::near::near;
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::probe::side::OpenObject;
use crate::query::probe::side::Side;
use crate::query::querier::Querier;
use crate::query::rounded::sum_of_radii;
use crate::traverse::placement::{ObjectPair, Placement};
use bvh_format::object::Object;
use bvh_format::validate::packets;

/// How two meshes lie. The command and the bindings of other languages use its numbers: `relation as u8`.
///
/// [`Querier::relation`](crate::Querier::relation) has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Relation {
    /// Their surfaces have a point in common: [`Querier::collide`](crate::Querier::collide) is true.
    Touching = 0,
    /// They have nothing in common, insides included.
    Apart = 1,
    /// All of A is inside B.
    AInB = 2,
    /// All of B is inside A.
    BInA = 3,
    /// Some connected components are inside the other mesh and some are not, or some of each mesh are.
    Mixed = 4,
    /// The answer depends on the inside of a mesh that is not closed.
    Undefined = 5,
}

impl Querier {
    /// Returns the relation of two meshes, with B placed by a pose in A's frame: whether they touch and, if not,
    /// whether one is inside the other.
    ///
    /// [`Querier::collide`] is about surfaces, so a mesh inside another does not collide with it. This query finds
    /// such a mesh. If no triangles touch, each connected component of a mesh is wholly on one side of the other mesh,
    /// and one point of the component tells which. The answer is exact and has the same bits on all backends.
    ///
    /// An object that is not closed contains nothing that is certainly apart from its box. If an object of the other
    /// mesh may meet that box, it is unknown whether the open object contains it. The answer is then
    /// [`Relation::Undefined`], unless other objects decide it: an open mesh inside a closed one is inside it.
    ///
    /// Shapes with radii touch if their cores are within the sum of the radii, and an open core within a radius contains
    /// nothing. Whether a shape is solid does not matter here.
    ///
    /// Cost: that of `collide`, and about a microsecond per connected component.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier, Relation};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let small = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([1.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// assert_eq!(querier.relation(&block, &small, &at(0.0)?)?, Relation::BInA);
    /// assert_eq!(querier.relation(&block, &small, &at(1.0)?)?, Relation::Touching);
    /// assert_eq!(querier.relation(&block, &small, &at(2.0)?)?, Relation::Apart);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::NoTopology`] if a file that this query needs was baked without topology;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged; [`QueryError::Budget`] if the budget does
    /// not suffice.
    pub fn relation<'a, 'b>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'b>>,
        pose: &Pose,
    ) -> Result<Relation, QueryError> {
        self.start();
        self.relation_of(a.into(), b.into(), pose)
    }

    /// Returns the relation of two shapes, as a part of a larger question.
    pub(crate) fn relation_of(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Relation, QueryError> {
        if self.cores_within(a, b, pose, sum_of_radii(a, b))? {
            return Ok(Relation::Touching);
        }
        self.relation_of_disjoint(a, b, pose)
    }

    /// Returns the relation of two shapes that do not touch.
    pub(crate) fn relation_of_disjoint(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Relation, QueryError> {
        let (own, placed) = (PlacedShape::from(a), b.at(pose));
        let may_contain = |of_a: usize, of_b: usize| {
            let (object_a, object_b) = (&a.objects()[of_a], &b.objects()[of_b]);
            let placement = &Placement::new(pose, object_a, object_b);
            let (bvh_a, bvh_b) = (a.bvh(), b.bvh());
            !surely_apart(&ObjectPair { bvh_a, object_a, bvh_b, object_b, placement, end: placement })
        };
        let a_in_b = self.components_in(&own, &placed, may_contain)?;
        let b_in_a = self.components_in(&placed, &own, |of_b, of_a| may_contain(of_a, of_b))?;
        Ok(relation(a_in_b, b_in_a))
    }

    /// Counts the components of a mesh that are inside another. `may_contain` tells of an object of each whether their boxes
    /// may meet.
    fn components_in(
        &mut self,
        mesh: &PlacedShape<'_>,
        container: &PlacedShape<'_>,
        may_contain: impl Fn(usize, usize) -> bool,
    ) -> Result<Components, QueryError> {
        let mut components = Components::default();
        let bvh = mesh.shape.bvh();
        for (index, object) in mesh.shape.objects().iter().enumerate() {
            let topology = bvh.topology(mesh.shape.first() + index)?;
            let mut is_known = true;
            for other in 0..container.shape.objects().len() {
                self.memory.budget.visit()?;
                let number = container.shape.first() + other;
                // An open core within a radius contains nothing: what is around it is outside.
                let contains_nothing = container.shape.radius() > 0.0 || !may_contain(index, other);
                is_known &= contains_nothing || container.shape.bvh().topology(number)?.closed;
            }
            let mut listed = topology.components();
            if !is_known {
                components.undefined +=
                    if listed.len() == 0 { object.triangles() } else { listed.len() as u64 };
                continue;
            }
            let mut ask = |place: TrianglePlace| -> Result<bool, QueryError> {
                let corner = stored_at(bvh, object, place)?[0];
                let point = mesh.pose.map_or(corner, |pose| pose.place(corner));
                components.count(self.side_of(container, &point, OpenObject::Empty)?);
                Ok(false)
            };
            if listed.len() != 0 {
                listed.try_for_each(|place| ask(bvh.triangle_place(object, place)?).map(drop))?;
            } else {
                each_triangle(bvh, object, ask)?;
            }
        }
        Ok(components)
    }
}

impl Querier {
    /// Returns a point of a connected component of one core that is inside another shape, which is solid.
    pub(crate) fn first_inside(
        &mut self,
        mesh: &PlacedShape<'_>,
        container: &PlacedShape<'_>,
    ) -> Result<Option<[f64; 3]>, QueryError> {
        let bvh = mesh.shape.bvh();
        for (index, object) in mesh.shape.objects().iter().enumerate() {
            let listed = match bvh.topology(mesh.shape.first() + index) {
                Ok(topology) => Some(topology.components()).filter(|listed| listed.len() != 0),
                Err(QueryError::NoTopology) => None,
                Err(error) => return Err(error),
            };
            // Only a triangle in the container's box may be inside it.
            let candidates = match listed {
                Some(_) => Vec::new(),
                None => {
                    let bounds = IntoObject::new(mesh.pose.as_ref(), object).bounds_of(container);
                    near(bvh, object, &bounds, &mut self.memory.budget)?
                }
            };
            let mut found = None;
            let mut ask = |place: TrianglePlace| -> Result<bool, QueryError> {
                let corner = stored_at(bvh, object, place)?[0];
                let point = mesh.pose.map_or(corner, |pose| pose.place(corner));
                if self.side_of(container, &point, OpenObject::Empty)? == Side::Inside {
                    found = Some(point);
                }
                Ok(found.is_some())
            };
            match listed {
                Some(listed) => {
                    for place in listed {
                        if ask(bvh.triangle_place(object, place)?)? {
                            break;
                        }
                    }
                }
                None => {
                    for place in candidates {
                        if ask(place)? {
                            break;
                        }
                    }
                }
            }
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }
}

/// Visits the stored triangles of an object until one suffices: where components are not listed, each triangle counts as one.
pub(crate) fn each_triangle(
    bvh: &Bvh,
    object: &Object,
    mut visit: impl FnMut(TrianglePlace) -> Result<bool, QueryError>,
) -> Result<(), QueryError> {
    for number in object.pages() {
        let page = bvh.page(object, number)?;
        for (packet, triangles) in packets(&page) {
            for lane in 0..triangles as u8 {
                if visit(TrianglePlace { page: number, packet, lane })? {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}

/// The components of a mesh by the side of another that they are on.
#[derive(Clone, Copy, Debug, Default)]
struct Components {
    inside: u64,
    outside: u64,
    undefined: u64,
}

impl Components {
    fn count(&mut self, side: Side) {
        match side {
            // On the surface is none where nothing touches.
            Side::Inside | Side::On => self.inside += 1,
            Side::Outside => self.outside += 1,
            Side::Undefined => self.undefined += 1,
        }
    }

    fn are_divided(&self) -> bool {
        self.inside > 0 && self.outside > 0
    }

    fn are_all_inside(&self) -> bool {
        self.outside == 0 && self.undefined == 0
    }
}

fn relation(a_in_b: Components, b_in_a: Components) -> Relation {
    if a_in_b.are_all_inside() && b_in_a.inside == 0 {
        Relation::AInB
    } else if b_in_a.are_all_inside() && a_in_b.inside == 0 {
        Relation::BInA
    } else if a_in_b.are_divided() || b_in_a.are_divided() || a_in_b.inside > 0 && b_in_a.inside > 0 {
        Relation::Mixed
    } else if a_in_b.undefined + b_in_a.undefined > 0 {
        Relation::Undefined
    } else {
        Relation::Apart
    }
}
