//! The directed edges of a mesh, by the vertex that they leave.

/// For each vertex where the edges that leave it lead, and whose they are: three a triangle.
pub(super) struct Edges {
    first: Vec<usize>,
    /// The vertex at the end, and the triangle on the left.
    out: Vec<[u32; 2]>,
}

impl Edges {
    pub(super) fn new(vertices: usize, triangles: &[[u32; 3]]) -> Edges {
        let mut first = vec![0usize; vertices + 1];
        for &corner in triangles.as_flattened() {
            first[corner as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            first[vertex + 1] += first[vertex];
        }
        let mut out = vec![[0u32; 2]; 3 * triangles.len()];
        let mut next = first.clone();
        for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                out[next[from as usize]] = [to, triangle as u32];
                next[from as usize] += 1;
            }
        }
        Edges { first, out }
    }

    /// The edges that leave a vertex: where they lead, and the triangle on their left.
    pub(super) fn from(&self, vertex: u32) -> &[[u32; 2]] {
        &self.out[self.first[vertex as usize]..self.first[vertex as usize + 1]]
    }

    /// The triangle on the left of an edge.
    pub(super) fn left_of(&self, from: u32, to: u32) -> Option<u32> {
        self.from(from).iter().find(|edge| edge[0] == to).map(|edge| edge[1])
    }

    /// The edges along which the mesh ends, which lies on their left.
    pub(super) fn border(&self) -> Vec<[u32; 2]> {
        let mut border = Vec::new();
        for from in 0..self.first.len() as u32 - 1 {
            let open = self.from(from).iter().filter(|edge| self.left_of(edge[0], from).is_none());
            border.extend(open.map(|edge| [from, edge[0]]));
        }
        border
    }
}
