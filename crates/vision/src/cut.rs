//! The cheapest division of a grid into an inside and an outside: a minimum cut, by the two search trees of Boykov and Kolmogorov
//! (2004), "An experimental comparison of min-cut/max-flow algorithms for energy minimization in vision", section 3.

use pursuit_geometry::Size;
use std::collections::VecDeque;

/// Which neighbour a cell is joined to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbor {
    /// The next column.
    Right = 0,
    /// The next row.
    Below = 1,
    /// The next column of the next row.
    BelowRight = 2,
    /// The column before, of the next row.
    BelowLeft = 3,
}

impl Neighbor {
    /// All of them: with these each pair of neighbours is named once.
    pub const ALL: [Self; 4] = [Self::Right, Self::Below, Self::BelowRight, Self::BelowLeft];
}

/// Who owns a cell while the trees grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tree {
    Free,
    Inside,
    Outside,
}

/// Where a cell hangs in its tree: at a neighbour by its number, else one of these.
const AT_ROOT: u8 = 8;
const ORPHAN: u8 = 9;

/// A grid of cells, each of which is to be called inside or outside. Calling it either way has a cost, and so has calling two joined
/// neighbours differently; [`solve`](Self::solve) finds the calls whose sum of costs is least. Owns its scratch, so that
/// nothing is allocated from grid to grid once it is warm.
///
/// ```
/// use pursuit_geometry::Size;
/// use pursuit_vision::cut::{GridCut, Neighbor};
///
/// let mut cut = GridCut::default();
/// cut.reset(Size::new(3, 1));
/// cut.add(0, 0, 0, 9); // being outside would cost 9
/// cut.add(1, 0, 2, 0); // being inside would cost 2, less than to differ from the left one
/// cut.add(2, 0, 5, 0);
/// cut.join(0, 0, Neighbor::Right, 4);
/// cut.join(1, 0, Neighbor::Right, 1);
/// assert_eq!(cut.solve(), 2 + 1);
/// assert_eq!([0, 1, 2].map(|x| cut.is_inside(x, 0)), [true, true, false]);
/// ```
#[derive(Debug, Clone, Default)]
pub struct GridCut {
    size: Size,
    /// Steps to the eight neighbours in the grid with a border of one cell; that numbered `d ^ 4` leads back.
    steps: [isize; 8],
    /// What can still flow to each neighbour.
    left: Vec<[i32; 8]>,
    /// What can still flow from the source, or, below 0, into the sink.
    terminal: Vec<i32>,
    tree: Vec<Tree>,
    parent: Vec<u8>,
    /// The stage of adoption in which the distance from the root was found, and that distance.
    seen: Vec<u32>,
    depth: Vec<u32>,
    stage: u32,
    active: VecDeque<usize>,
    is_active: Vec<bool>,
    orphans: VecDeque<usize>,
    flow: i64,
}

impl GridCut {
    /// Begins a grid of `size`: all costs are 0.
    pub fn reset(&mut self, size: Size) {
        let stride = size.width + 2;
        let cells = stride * (size.height + 2);
        let down = stride.cast_signed();
        self.size = size;
        self.steps = [1, down, down + 1, down - 1, -1, -down, -down - 1, 1 - down];
        let fresh = |cells| std::iter::repeat_n(0, cells);
        self.left.clear();
        self.left.resize(cells, [0; 8]);
        self.terminal.clear();
        self.terminal.extend(fresh(cells));
        self.tree.clear();
        self.tree.resize(cells, Tree::Free);
        self.parent.clear();
        self.parent.resize(cells, ORPHAN);
        for numbers in [&mut self.seen, &mut self.depth] {
            numbers.clear();
            numbers.resize(cells, 0);
        }
        self.is_active.clear();
        self.is_active.resize(cells, false);
        self.active.clear();
        self.orphans.clear();
        (self.stage, self.flow) = (0, 0);
    }

    fn cell(&self, x: usize, y: usize) -> usize {
        (y + 1) * (self.size.width + 2) + x + 1
    }

    /// Adds to what it costs to call the cell in column `x`, row `y` inside and outside. The costs of a cell and of its
    /// joins together must stay below 2³⁰.
    ///
    /// # Panics
    /// A cell outside of the grid.
    pub fn add(&mut self, x: usize, y: usize, inside: i32, outside: i32) {
        assert!(x < self.size.width && y < self.size.height, "cell ({x}, {y}) is outside of {}", self.size);
        let at = self.cell(x, y);
        self.terminal[at] += outside - inside;
        self.flow += i64::from(inside.min(outside));
    }

    /// Makes it cost `weight` ≥ 0 to call the cell in column `x`, row `y` and this neighbour differently; nothing where there is no
    /// such neighbour.
    ///
    /// # Panics
    /// A cell outside of the grid.
    pub fn join(&mut self, x: usize, y: usize, to: Neighbor, weight: i32) {
        assert!(x < self.size.width && y < self.size.height, "cell ({x}, {y}) is outside of {}", self.size);
        let there = match to {
            Neighbor::Right => x + 1 < self.size.width,
            Neighbor::Below => y + 1 < self.size.height,
            Neighbor::BelowRight => x + 1 < self.size.width && y + 1 < self.size.height,
            Neighbor::BelowLeft => x > 0 && y + 1 < self.size.height,
        };
        if there && weight > 0 {
            let (at, d) = (self.cell(x, y), to as usize);
            let other = self.step(at, d);
            self.left[at][d] += weight;
            self.left[other][d ^ 4] += weight;
        }
    }

    fn step(&self, at: usize, d: usize) -> usize {
        at.wrapping_add_signed(self.steps[d])
    }

    /// Finds the calls that cost least together, and says what they cost; once for each grid. Where several cost the same, the one with
    /// the fewest cells inside.
    pub fn solve(&mut self) -> i64 {
        for y in 0..self.size.height {
            for x in 0..self.size.width {
                let at = self.cell(x, y);
                if self.terminal[at] != 0 {
                    self.tree[at] = if self.terminal[at] > 0 { Tree::Inside } else { Tree::Outside };
                    self.parent[at] = AT_ROOT;
                    self.activate(at);
                }
            }
        }
        while let Some(at) = self.active.pop_front() {
            // It may become active again while it grows: a neighbour that it has passed may be let go.
            self.is_active[at] = false;
            let mut d = 0;
            while d < 8 && self.tree[at] != Tree::Free {
                match self.grow(at, d) {
                    // The same way may serve again.
                    Some((from, d, to)) => {
                        self.augment(from, d, to);
                        self.adopt();
                    }
                    None => d += 1,
                }
            }
        }
        self.flow
    }

    /// Whether [`solve`](Self::solve) called the cell inside; `false` outside of the grid.
    pub fn is_inside(&self, x: usize, y: usize) -> bool {
        x < self.size.width && y < self.size.height && self.tree[self.cell(x, y)] == Tree::Inside
    }

    fn activate(&mut self, at: usize) {
        if !self.is_active[at] {
            self.is_active[at] = true;
            self.active.push_back(at);
        }
    }

    /// What can flow between a cell of a tree and its neighbour `d`, towards the leaf in the tree of the source, towards the root in
    /// that of the sink.
    fn outward(&self, at: usize, d: usize) -> i32 {
        match self.tree[at] {
            Tree::Outside => self.left[self.step(at, d)][d ^ 4],
            _ => self.left[at][d],
        }
    }

    /// Takes a free neighbour into the tree; where the neighbour is of the other tree, the way from inside to outside.
    fn grow(&mut self, at: usize, d: usize) -> Option<(usize, usize, usize)> {
        if self.outward(at, d) <= 0 {
            return None;
        }
        let other = self.step(at, d);
        let (own, theirs) = (self.tree[at], self.tree[other]);
        if theirs == Tree::Free {
            self.tree[other] = own;
            self.parent[other] = (d ^ 4) as u8;
            self.activate(other);
            return None;
        }
        match (own, theirs) {
            (Tree::Inside, Tree::Outside) => Some((at, d, other)),
            (Tree::Outside, Tree::Inside) => Some((other, d ^ 4, at)),
            _ => None,
        }
    }

    /// Lets as much flow as can from the source through both trees into the sink; cells whose way to their root is used up by it
    /// are orphans.
    fn augment(&mut self, from: usize, d: usize, to: usize) {
        let mut most = self.left[from][d];
        for mut at in [from, to] {
            while self.parent[at] != AT_ROOT {
                let up = usize::from(self.parent[at]);
                let above = self.step(at, up);
                most = most.min(self.inward(at, up, above));
                at = above;
            }
            most = most.min(self.terminal[at].abs());
        }
        self.left[from][d] -= most;
        self.left[to][d ^ 4] += most;
        for mut at in [from, to] {
            while self.parent[at] != AT_ROOT {
                let up = usize::from(self.parent[at]);
                let above = self.step(at, up);
                let change = if self.tree[at] == Tree::Inside { most } else { -most };
                self.left[above][up ^ 4] -= change;
                self.left[at][up] += change;
                if self.inward(at, up, above) == 0 {
                    self.orphan(at);
                }
                at = above;
            }
            self.terminal[at] -= most * self.terminal[at].signum();
            if self.terminal[at] == 0 {
                self.orphan(at);
            }
        }
        self.flow += i64::from(most);
    }

    /// What can flow between a cell and the neighbour `up` that it hangs at.
    fn inward(&self, at: usize, up: usize, above: usize) -> i32 {
        match self.tree[at] {
            Tree::Outside => self.left[at][up],
            _ => self.left[above][up ^ 4],
        }
    }

    fn orphan(&mut self, at: usize) {
        self.parent[at] = ORPHAN;
        self.orphans.push_back(at);
    }

    /// Hangs every orphan at another neighbour of its tree, the nearest to the root; those for which there is none are free.
    fn adopt(&mut self) {
        self.stage += 1;
        while let Some(at) = self.orphans.pop_front() {
            let own = self.tree[at];
            let mut best: Option<(u32, usize)> = None;
            for d in 0..8 {
                let other = self.step(at, d);
                if self.tree[other] == own && self.inward(at, d, other) > 0 {
                    let depth = self.depth_of(other);
                    best = best.into_iter().chain(depth.map(|depth| (depth, d))).min();
                }
            }
            if let Some((depth, d)) = best {
                self.parent[at] = d as u8;
                (self.seen[at], self.depth[at]) = (self.stage, depth + 1);
                continue;
            }
            for d in 0..8 {
                let other = self.step(at, d);
                if self.tree[other] != own {
                    continue;
                }
                // Whoever could reach it may take it again.
                if self.inward(at, d, other) > 0 {
                    self.activate(other);
                }
                if usize::from(self.parent[other]) == d ^ 4 {
                    self.orphan(other);
                }
            }
            self.tree[at] = Tree::Free;
        }
    }

    /// How far a cell is from its root; `None` where the way leads to an orphan. What was found is noted: while orphans are adopted, a
    /// way that leads to the root stays one.
    fn depth_of(&mut self, cell: usize) -> Option<u32> {
        let (mut at, mut steps) = (cell, 0);
        let mut depth = loop {
            if self.seen[at] == self.stage {
                break self.depth[at] + steps;
            }
            match self.parent[at] {
                AT_ROOT => break steps,
                ORPHAN => return None,
                up => at = self.step(at, usize::from(up)),
            }
            steps += 1;
        };
        let found = depth;
        at = cell;
        while self.seen[at] != self.stage {
            (self.seen[at], self.depth[at]) = (self.stage, depth);
            match self.parent[at] {
                AT_ROOT | ORPHAN => break,
                up => at = self.step(at, usize::from(up)),
            }
            depth -= 1;
        }
        Some(found)
    }
}

#[cfg(test)]
mod tests;
