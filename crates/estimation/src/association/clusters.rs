//! What hangs together: a forest over things that are joined pair by pair.

/// Keeps its memory from one problem to the next.
#[derive(Debug, Clone, Default)]
pub(super) struct Clusters {
    /// Each thing points to one of its cluster, the root to itself.
    parent: Vec<usize>,
}

impl Clusters {
    /// So many things, each by itself.
    pub fn start(&mut self, things: usize) {
        self.parent.clear();
        self.parent.extend(0..things);
    }

    /// The first thing of a cluster; shortens the way there.
    pub fn root(&mut self, mut thing: usize) -> usize {
        while self.parent[thing] != thing {
            self.parent[thing] = self.parent[self.parent[thing]];
            thing = self.parent[thing];
        }
        thing
    }

    /// Joins two clusters.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }
}
