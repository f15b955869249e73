//! The tree of nodes, walked from the roots of the scene, with the place of each in the world.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::document::{Document, Node};

/// A node that is reached, in the order of the tree.
#[derive(Debug)]
pub(super) struct Placed<'a> {
    pub(super) node: &'a Node,
    /// From coordinates of the node to those of the world.
    pub(super) world: DAffine3,
}

/// The nodes of the scene that is shown.
#[derive(Debug)]
pub(super) struct Walk<'a> {
    pub(super) placed: Vec<Placed<'a>>,
    /// Nodes that are named a second time: by two parents, or by one of their own children. Each is taken once.
    pub(super) repeated: usize,
    /// Names of nodes that do not exist.
    pub(super) unknown: usize,
}

/// Walk through the default scene, else the first one; in a file without scenes, through all nodes.
///
/// # Errors
/// Where the default scene does not exist.
pub(super) fn walk(document: &Document) -> Result<Walk<'_>, String> {
    let roots: Vec<usize> = match (document.scene, document.scenes.first()) {
        (Some(scene), _) => match document.scenes.get(scene) {
            Some(roots) => roots.nodes.clone(),
            None => {
                return Err(format!(
                    "scene {scene} is to be shown, but the file has {}; export it again",
                    document.scenes.len()
                ));
            }
        },
        (None, Some(first)) => first.nodes.clone(),
        (None, None) => without_parent(document),
    };
    let mut walk = Walk {
        placed: Vec::new(),
        repeated: 0,
        unknown: 0,
    };
    let mut is_reached = vec![false; document.nodes.len()];
    let begin = |&root: &usize| (root, DAffine3::IDENTITY);
    // The next one is the last.
    let mut waiting: Vec<(usize, DAffine3)> = roots.iter().rev().map(begin).collect();
    while let Some((index, parent)) = waiting.pop() {
        let Some(node) = document.nodes.get(index) else {
            walk.unknown += 1;
            continue;
        };
        if std::mem::replace(&mut is_reached[index], true) {
            walk.repeated += 1;
            continue;
        }
        let world = parent * local(node);
        let children = node.children.iter().rev();
        waiting.extend(children.map(|&child| (child, world)));
        walk.placed.push(Placed { node, world });
    }
    Ok(walk)
}

/// Nodes that are no child of another.
fn without_parent(document: &Document) -> Vec<usize> {
    let mut has_parent = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(flag) = has_parent.get_mut(child) {
            *flag = true;
        }
    }
    (0..has_parent.len())
        .filter(|&node| !has_parent[node])
        .collect()
}

/// The transform of a node in its parent: its matrix, or scale, then rotation, then translation.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        let column = |at: usize| DVec3::new(matrix[at], matrix[at + 1], matrix[at + 2]);
        return DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(4), column(8)),
            translation: column(12),
        };
    }
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let length = rotation.length();
    let rotation = match length > 0.0 && length.is_finite() {
        true => rotation / length,
        false => DQuat::IDENTITY,
    };
    DAffine3::from_scale_rotation_translation(
        DVec3::from_array(node.scale.unwrap_or([1.0; 3])),
        rotation,
        DVec3::from_array(node.translation.unwrap_or_default()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document(text: &str) -> Document {
        serde_json::from_str(text).unwrap()
    }

    /// Names of the nodes that are reached, and where each has its origin.
    fn reached(text: &str) -> Vec<(String, [f64; 3])> {
        let document = document(text);
        let placed = walk(&document).unwrap().placed.into_iter();
        placed
            .map(|placed| {
                (
                    placed.node.name.clone(),
                    placed.world.translation.to_array(),
                )
            })
            .collect()
    }

    #[test]
    fn children_stand_in_their_parents() {
        let text = r#"{"scenes":[{"nodes":[0]},{"nodes":[2]}],"nodes":[
            {"name":"a","children":[2,1],"scale":[2,2,-2],"translation":[1,0,0],"rotation":[0,0,2,2]},
            {"name":"b","translation":[0,0,1]},
            {"name":"c","matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 1,0,0,1]}]}"#;
        let found = reached(text);
        assert_eq!(
            found
                .iter()
                .map(|(name, _)| name.as_str())
                .collect::<String>(),
            "acb"
        );
        for ((_, found), expected) in
            found
                .iter()
                .zip([[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 0.0, -2.0]])
        {
            let difference = DVec3::from_array(*found) - DVec3::from_array(expected);
            assert!(difference.length() < 1e-12, "{found:?}");
        }
        let second = text.replacen('{', r#"{"scene":1,"#, 1);
        assert_eq!(reached(&second), [("c".to_owned(), [1.0, 0.0, 0.0])]);
        let none = text.replace("scenes", "others");
        assert_eq!(reached(&none).len(), 3);
    }

    #[test]
    fn circles_and_unknown_nodes_end() {
        let circle = document(
            r#"{"scenes":[{"nodes":[0,0,9]}],"nodes":[{"children":[1]},{"children":[0,1,7]}]}"#,
        );
        let walked = walk(&circle).unwrap();
        assert_eq!(
            (walked.placed.len(), walked.repeated, walked.unknown),
            (2, 3, 2)
        );
        assert!(walk(&document(r#"{"scene":3}"#)).is_err());
        let chain: Vec<String> = (1..=100_000)
            .map(|next| format!(r#"{{"children":[{next}]}}"#))
            .collect();
        let chain = document(&format!(r#"{{"nodes":[{}]}}"#, chain.join(",")));
        assert_eq!(walk(&chain).unwrap().placed.len(), 100_000);
    }

    #[test]
    fn a_rotation_without_length_turns_nothing() {
        let node = Node {
            rotation: Some([0.0; 4]),
            ..Node::default()
        };
        assert_eq!(local(&node), DAffine3::IDENTITY);
    }
}
