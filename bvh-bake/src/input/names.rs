//! Keeps the objects of an OBJ file by name: those of `o` statements, or of `g` statements if the file has no `o`.

use crate::input::indexed::FaceRun;
use std::collections::HashMap;

/// The objects named so far, and the current one.
///
/// Only the end of the file shows whether `g` names objects. It does until the first `o`; at the first `o`, all faces
/// above it turn out to have no name.
#[derive(Default)]
pub(crate) struct Names {
    /// The names, by the number of the object.
    names: Vec<String>,
    numbers: HashMap<Vec<u8>, u32>,
    current: Option<u32>,
    has_faces: bool,
    /// The number of statements that named an object.
    groups: u32,
    /// The group that the first `o` began; 0 before the first `o`.
    first_group: u32,
}

impl Names {
    /// Makes one object without a name.
    pub(crate) fn unnamed() -> Self {
        Self { names: vec![String::new()], ..Self::default() }
    }

    /// Makes objects with these names, in order. A group is an object.
    pub(crate) fn of_objects(names: Vec<String>) -> Self {
        Self { names, ..Self::default() }
    }

    /// Returns the names by number.
    pub(crate) fn all(&self) -> &[String] {
        &self.names
    }

    /// Makes the object with a name the current one. Returns whether the name is new.
    pub(super) fn enter(&mut self, is_object: bool, name: &[u8]) -> bool {
        if !is_object && self.first_group > 0 {
            return false;
        }
        self.groups += 1;
        if is_object && self.first_group == 0 {
            (self.names, self.numbers) = Default::default();
            if self.has_faces {
                self.number(b"");
            }
            self.first_group = self.groups;
        }
        let before = self.names.len();
        self.current = Some(self.number(name));
        self.names.len() > before
    }

    /// Returns the object and the group for the faces that follow. Faces above the first name have no name.
    pub(super) fn current(&mut self) -> (u32, u32) {
        self.has_faces = true;
        let object = match self.current {
            Some(object) => object,
            None => self.number(b""),
        };
        self.current = Some(object);
        (object, self.groups)
    }

    /// Returns the final object and group of a run of faces, after the whole file has been read.
    pub(crate) fn of(&self, run: &FaceRun) -> (usize, u32) {
        if run.group < self.first_group { (0, 0) } else { (run.object as usize, run.group) }
    }

    fn number(&mut self, name: &[u8]) -> u32 {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.names.len() as u32;
        self.names.push(String::from_utf8_lossy(name).into_owned());
        self.numbers.insert(name.to_vec(), number);
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_name_objects_only_without_an_o() {
        let mut names = Names::default();
        let run = |(object, group)| FaceRun { corners: 3, object, group, faces: 1 };
        let bare = run(names.current());
        names.enter(false, b"left");
        let left = run(names.current());
        assert_eq!((names.of(&bare), names.of(&left)), ((0, 0), (1, 1)));
        assert_eq!(names.all(), ["", "left"]);
        names.enter(true, b"arm");
        names.enter(false, b"ignored");
        let arm = run(names.current());
        names.enter(true, b"");
        let unnamed = run(names.current());
        assert_eq!(names.all(), ["", "arm"]);
        assert_eq!([bare, left, arm, unnamed].map(|run| names.of(&run)), [(0, 0), (0, 0), (1, 2), (0, 3)]);
    }
}
