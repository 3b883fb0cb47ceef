//! Lists the numbered rules of the specification, one name each.

use std::fmt;

macro_rules! rules {
    ($($name:ident = $number:literal, $text:literal;)*) => {
        /// A numbered rule of `spec/format.md`, section 16.2. Errors and the names of test files state its number.
        /// Later minor versions of the format may add rules.
        ///
        /// ```
        /// use bvh_format::Rule;
        ///
        /// let rule = Rule::PageChecksum;
        /// assert_eq!((rule.number(), rule.text()), (15, "the checksum in a page header is that of the page"));
        /// assert_eq!(rule.to_string(), format!("R15 ({})", rule.text()));
        /// println!("{}", rule.remedy());
        /// ```
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Rule { $(#[doc = $text] $name = $number,)* }

        impl Rule {
            /// All rules in the order of their numbers.
            pub const ALL: &'static [Rule] = &[$(Rule::$name,)*];

            /// Returns the rule in one phrase, in the words of the specification.
            pub fn text(self) -> &'static str {
                match self { $(Rule::$name => $text,)* }
            }
        }
    };
}

rules! {
    Magic = 1, "the file starts with the magic bytes";
    Version = 2, "the major version is one that this reader knows";
    HeaderSize = 3, "the file holds a whole header";
    HeaderChecksum = 4, "the checksum in the header is that of the header and the section table";
    FileLength = 5, "the file is as long as the header states";
    SectionCount = 6, "the section table is in the file and has at most 64 entries";
    SectionPlace = 7, "sections are aligned, in order, and within the file";
    SectionKnown = 8, "a required section is of a kind that this reader knows";
    SectionOnce = 9, "the needed sections are there, each once";
    SectionChecksum = 10, "a section has the checksum that the table states";
    ObjectTable = 11, "the object table has one record of 192 bytes per object and names within its bytes";
    ObjectNumbers = 12, "an object's numbers are finite, ordered and within the limits";
    ObjectPages = 13, "the objects' pages follow each other and fill the node section";
    ObjectProfile = 14, "an object's profile and triangle encoding are known";
    PageChecksum = 15, "the checksum in a page header is that of the page";
    PageNumber = 16, "a page header gives the page's place in the node section";
    PageShape = 17, "header, anchors, remote links and treelets of a page fit in it";
    PageProfile = 18, "a page has its object's profile";
    AnchorSlabs = 19, "an anchor's slabs are finite and ordered";
    AnchorParent = 20, "an anchor names the page and the remote link that lead to its root";
    ChildKinds = 21, "a treelet has at least one child, of known kinds, without gaps, at most its width";
    TreeletLinks = 22, "treelets are numbered breadth-first: roots first, then the children in order";
    RemoteLinks = 23, "remote links are numbered in treelet order and lead to later pages of the object";
    LeafLinks = 24, "leaf packets are numbered in treelet order";
    ShortTreelets = 25, "short treelets are in profiles that have them, and none is a root";
    LeafPlace = 26, "a leaf block lies within the leaf section and has the size its packets need";
    LeafChecksum = 27, "a leaf block has the checksum that its page states";
    PackedHeader = 28, "a packed leaf block's bit widths are within the limits and its parts within the block";
    PackedRecord = 29, "a packed packet's slots are those of vertices in the block's pool";
    VertexFinite = 30, "the offset of a coordinate is finite and at most 2^120 in magnitude";
    IdPlace = 31, "an id block lies within the id section and has the size its packets need";
    IdChecksum = 32, "an id block has the checksum that its page states";
    IdRange = 33, "a triangle id is below the number of triangles of the input";
    Counts = 34, "an object's counts of treelets, packets and triangles are those of its pages";
    BoundContains = 35, "every decoded slab contains the triangles below it";
    DuplicateIds = 36, "duplicate ids come in ascending pairs (kept, dropped)";
    VertexPlace = 37, "a coordinate is as near to its offset as its object states";
    Codes = 38, "codes that are floats are finite, and f16 codes not negative";
    TurningTriangles = 39, "a child with a turning slab has at most 1024 triangles below";
    InstanceTable = 40, "the instances section has one record of 128 bytes per instance and names within its bytes";
    InstanceObject = 41, "an instance is of an object of the file";
    InstancePose = 42, "an instance's pose is rigid and within the limits";
    InstanceName = 43, "no two instances have the same name";
    TopologyTable = 44, "the topology section has one record of 16 bytes per object and lists of the lengths that these state";
    TopologyRecord = 45, "an object is closed or open, and lists no more than it has";
    TopologyPlace = 46, "places in the topology section ascend and are those of triangles";
    TopologyNet = 47, "a listed net is not 1";
    TopologyClosed = 48, "a closed object has no boundary";
    Nested = 49, "the slabs of a node lie within those of its parent";
    InstanceMargin = 50, "an instance's margin is within the limits, and it is solid or not";
    SolidClosed = 51, "what is solid is closed";
    Corrections = 52, "corrections of a leaf block are of its corners, in order, and on axes that have them";
}

impl Rule {
    /// Returns the rule's number in the specification, from 1.
    pub fn number(self) -> u32 {
        self as u32
    }

    /// Returns what to do about a file that breaks the rule, in one phrase.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Magic => "this is not a .cbvh file: bake it first",
            // A later version may have written what this reader does not know.
            Self::Version | Self::SectionKnown | Self::ObjectProfile => "bake it again, or use a newer cbvh",
            _ => "the file is damaged: copy it again, or bake it again",
        }
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "R{:02} ({})", self.number(), self.text())
    }
}
