//! Cuts long polygons into triangles by ear clipping whose steps are counted.
//!
//! An ear is a convex corner whose triangle contains no other corner; only reflex corners can be in the way (Meisters 1975).
//! They are kept in a grid, so that a test looks at those near the triangle. A corner is tested again only after one of
//! its neighbours was clipped, so that there are at most three tests per corner. In usual polygons a test takes a few
//! steps, but in a hostile one it takes as many as there are corners. So steps are counted, and a polygon that takes too
//! many is given up.
//!
//! Signs are exact (`robust`). Corners are clipped in rounds that leave out the neighbours of an ear, because a fan of
//! slivers would make poor leaves.

/// The steps that are left.
pub(super) struct Steps {
    pub(super) left: u64,
}

/// The steps ran out.
#[derive(Debug, PartialEq)]
pub(super) struct OutOfSteps;

impl Steps {
    pub(super) fn take(&mut self, steps: usize) -> Result<(), OutOfSteps> {
        self.left = self.left.checked_sub(steps as u64).ok_or(OutOfSteps)?;
        Ok(())
    }
}

/// Cuts a counter-clockwise polygon that does not cross itself. Adds the corners of triangles to `ears`. Returns false if
/// no ear is found before the end, which exact polygons never do.
pub(super) fn clip(flat: &[[f64; 2]], steps: &mut Steps, ears: &mut Vec<u32>) -> Result<bool, OutOfSteps> {
    let mut ring = Ring::of(flat);
    let mut queue: Vec<u32> = (0..flat.len() as u32).collect();
    let mut later = Vec::new();
    // Whether a corner waits for the next round.
    let mut waits = vec![false; flat.len()];
    while ring.left > 2 {
        for &corner in &queue {
            if ring.left == 2 {
                break;
            }
            if waits[corner as usize] || ring.is_gone(corner) {
                continue;
            }
            steps.take(1)?;
            let (before, after) = ring.neighbours(corner);
            match ring.turn(corner) {
                turn if turn > 0.0 => {
                    if !ring.is_ear(corner, steps)? {
                        continue;
                    }
                    ears.extend([before, corner, after]);
                }
                0.0 => {}
                _ => continue,
            }
            ring.remove(corner);
            for neighbour in [before, after] {
                if !std::mem::replace(&mut waits[neighbour as usize], true) {
                    later.push(neighbour);
                }
            }
        }
        if later.is_empty() {
            return Ok(ring.left <= 2);
        }
        std::mem::swap(&mut queue, &mut later);
        later.clear();
        queue.iter().for_each(|&corner| waits[corner as usize] = false);
    }
    Ok(true)
}

/// The corners that have not been clipped, in a ring, and the reflex ones among them in a grid.
struct Ring<'a> {
    flat: &'a [[f64; 2]],
    before: Vec<u32>,
    after: Vec<u32>,
    left: usize,
    /// Whether a corner is reflex and not clipped. Clipping makes no corner reflex.
    is_reflex: Vec<bool>,
    grid: Grid,
}

impl<'a> Ring<'a> {
    fn of(flat: &'a [[f64; 2]]) -> Self {
        let count = flat.len() as u32;
        let mut ring = Self {
            flat,
            before: (0..count).map(|corner| (corner + count - 1) % count).collect(),
            after: (0..count).map(|corner| (corner + 1) % count).collect(),
            left: flat.len(),
            is_reflex: Vec::new(),
            grid: Grid::of(&[], &[]),
        };
        ring.is_reflex = (0..count).map(|corner| ring.turn(corner) < 0.0).collect();
        let reflex: Vec<u32> = (0..count).filter(|&corner| ring.is_reflex[corner as usize]).collect();
        ring.grid = Grid::of(flat, &reflex);
        ring
    }

    fn neighbours(&self, corner: u32) -> (u32, u32) {
        (self.before[corner as usize], self.after[corner as usize])
    }

    /// A clipped corner is its own neighbour.
    fn is_gone(&self, corner: u32) -> bool {
        self.after[corner as usize] == corner
    }

    /// Returns a number with the sign of the turn at a corner, which is positive if the corner is convex.
    fn turn(&self, corner: u32) -> f64 {
        let (before, after) = self.neighbours(corner);
        let [a, b, c] = [before, corner, after].map(|corner| self.flat[corner as usize]);
        turn(a, b, c)
    }

    /// Returns whether the triangle at a convex corner contains no reflex corner. Corners at the same place as one of its
    /// own are no obstacle: the ring touches itself there.
    fn is_ear(&self, corner: u32, steps: &mut Steps) -> Result<bool, OutOfSteps> {
        let (before, after) = self.neighbours(corner);
        let own = [before, corner, after].map(|corner| self.flat[corner as usize]);
        let [a, b, c] = own;
        let lo = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
        let hi = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
        for near in self.grid.rows(lo, hi) {
            steps.take(1 + near.len())?;
            for &other in near {
                let p = self.flat[other as usize];
                let may_be_inside = (0..2).all(|axis| lo[axis] <= p[axis] && p[axis] <= hi[axis]);
                if may_be_inside
                    && self.is_reflex[other as usize]
                    && !own.contains(&p)
                    && turn(a, b, p) >= 0.0
                    && turn(b, c, p) >= 0.0
                    && turn(c, a, p) >= 0.0
                {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    fn remove(&mut self, corner: u32) {
        let (before, after) = self.neighbours(corner);
        self.after[before as usize] = after;
        self.before[after as usize] = before;
        self.after[corner as usize] = corner;
        self.is_reflex[corner as usize] = false;
        self.left -= 1;
        for neighbour in [before, after] {
            let place = neighbour as usize;
            self.is_reflex[place] = self.is_reflex[place] && self.turn(neighbour) < 0.0;
        }
    }
}

/// Corners by the cells of a square grid, row by row.
struct Grid {
    lo: [f64; 2],
    cells_per_unit: [f64; 2],
    side: usize,
    /// The end of each cell in `corners`, after a 0.
    ends: Vec<u32>,
    corners: Vec<u32>,
}

impl Grid {
    /// Makes a grid of as many cells as corners.
    fn of(flat: &[[f64; 2]], corners: &[u32]) -> Self {
        let side = (corners.len() as f64).sqrt().ceil().max(1.0) as usize;
        let points = || corners.iter().map(|&corner| flat[corner as usize]);
        let lo = [0, 1].map(|axis| points().map(|p| p[axis]).fold(f64::INFINITY, f64::min));
        let hi = [0, 1].map(|axis| points().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max));
        let cells_per_unit = [0, 1].map(|axis| side as f64 / (hi[axis] - lo[axis]));
        let mut grid = Self { lo, cells_per_unit, side, ends: vec![0; side * side + 1], corners: Vec::new() };
        let cell_of = |grid: &Self, corner: u32| {
            let [x, y] = flat[corner as usize];
            grid.place(1, y) * side + grid.place(0, x)
        };
        for &corner in corners {
            let cell = cell_of(&grid, corner);
            grid.ends[cell + 1] += 1;
        }
        for cell in 0..side * side {
            grid.ends[cell + 1] += grid.ends[cell];
        }
        let mut next = grid.ends.clone();
        grid.corners = vec![0; corners.len()];
        for &corner in corners {
            let cell = cell_of(&grid, corner);
            grid.corners[next[cell] as usize] = corner;
            next[cell] += 1;
        }
        grid
    }

    /// Returns the column or row of a coordinate, which is the first or last one for coordinates outside. A larger
    /// coordinate has no smaller place.
    fn place(&self, axis: usize, value: f64) -> usize {
        let place = (value - self.lo[axis]) * self.cells_per_unit[axis];
        // A cast turns NaN into 0, which is what a grid without width gives for all its corners.
        (place as usize).min(self.side - 1)
    }

    /// Returns the corners of the cells that a box overlaps, row by row.
    fn rows(&self, lo: [f64; 2], hi: [f64; 2]) -> impl Iterator<Item = &[u32]> {
        let (first, last) = (self.place(0, lo[0]), self.place(0, hi[0]));
        (self.place(1, lo[1])..=self.place(1, hi[1])).map(move |row| {
            let (start, end) = (row * self.side + first, row * self.side + last + 1);
            &self.corners[self.ends[start] as usize..self.ends[end] as usize]
        })
    }
}

/// Returns a number with the sign of the area of a triangle, which is positive if it is counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let point = |[x, y]: [f64; 2]| robust::Coord { x, y };
    robust::orient2d(point(a), point(b), point(c))
}
