use super::Object;

/// Of objects of one class that overlap by more than `overlap` (IoU, 0 to 1) keeps the one with the best score; the rest comes
/// back best first, at most `most` of them. Of equals the first counts as better. Takes time in proportion to the number of
/// objects times what is kept.
pub fn suppress(objects: &mut Vec<Object>, overlap: f64, most: usize) {
    objects.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept = 0;
    for i in 0..objects.len() {
        if kept == most {
            break;
        }
        let object = objects[i];
        let rival = |better: &Object| better.class == object.class && better.bbox.iou(&object.bbox) > overlap;
        if !objects[..kept].iter().any(rival) {
            objects[kept] = object;
            kept += 1;
        }
    }
    objects.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_geometry::BBox;

    fn object(left: f64, score: f64, class: usize) -> Object {
        Object { bbox: BBox::from_ltwh(left, 0.0, 10.0, 10.0), score, class }
    }

    #[test]
    fn the_best_of_each_class_stays_where_boxes_overlap() {
        // Ten wide: moved by 2 they overlap by 8/12, by 4 by 6/14.
        let all =
            [object(0.0, 0.5, 0), object(2.0, 0.9, 0), object(4.0, 0.6, 0), object(2.0, 0.8, 1), object(6.0, 0.4, 0)];
        let kept = |overlap: f64, most: usize| {
            let mut objects = all.to_vec();
            suppress(&mut objects, overlap, most);
            objects.iter().map(|o| (o.score * 10.0).round() as u32).collect::<Vec<_>>()
        };
        assert_eq!(kept(0.5, 100), [9, 8, 4]);
        assert_eq!(kept(0.4, 100), [9, 8]);
        assert_eq!(kept(0.7, 100), [9, 8, 6, 5, 4]);
        assert_eq!(kept(0.7, 2), [9, 8]);
        assert_eq!(kept(0.7, 0), [0; 0]);
        assert_eq!(kept(0.0, 100), [9, 8]);
    }
}
