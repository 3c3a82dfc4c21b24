//! Where the masks of a Siamese network come from: an output with a plane for each of their places, or a network that draws one mask of what the
//! others answer about a point (the refinement of SiamMask: Wang et al. 2019, arXiv:1812.05050, section 3.2; PySOT, `pysot/models/head/mask.py`,
//! commit 2172c96).

use crate::{InferenceError, Network, Port, Result};

/// What draws masks, and of what. Of every search it is kept in full: which point counts is known afterwards, and other clones search meanwhile.
pub(super) enum Masks {
    /// An output of the answering network.
    Planes(usize),
    /// A network of its own.
    Refined {
        network: Box<dyn Network>,
        /// What each of its inputs is cut out of.
        cuts: Vec<Cut>,
    },
}

/// An input of the refining network: a window about the point, out of an output of the others; 0 beyond its border.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// Whether the output is of the head, and which it is.
    of_head: bool,
    output: usize,
    planes: usize,
    /// Rows and columns of the output, and of the window.
    map: usize,
    side: usize,
    /// Places of the output from one point to the next.
    step: usize,
}

/// How points lie in a search image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Points {
    /// Rows and columns of the search image.
    pub search: usize,
    /// Pixels from one point to the next.
    pub stride_px: f64,
}

impl Cut {
    /// Copies the window about the point in row and column `point` of an answer of `answer` points a side.
    fn copy(&self, from: &[f32], point: (usize, usize), answer: usize, to: &mut [f32]) {
        let Self { map, side, step, .. } = *self;
        // Windows lie about the middle of the map as the points do about the middle of the image.
        let first = |k: usize| {
            let all = map as i64 - side as i64 - (answer as i64 - 1) * step as i64;
            all.div_euclid(2) + (k * step) as i64
        };
        let (top, left) = (first(point.0), first(point.1));
        for (k, to) in to.chunks_exact_mut(side).enumerate() {
            let (plane, y) = (k / side, top + (k % side) as i64);
            let row = usize::try_from(y).ok().filter(|&y| y < map).map(|y| &from[(plane * map + y) * map..][..map]);
            for (x, to) in (left..).zip(to) {
                *to = usize::try_from(x).ok().and_then(|x| row?.get(x)).copied().unwrap_or(0.0);
            }
        }
    }
}

impl Masks {
    /// The output of `answering` that has a plane for each place of a mask of `side` rows and columns.
    pub fn planes(answering: &dyn Network, side: usize, answer: usize) -> Result<Self> {
        let wanted = [1, side * side, answer, answer];
        let found = answering.outputs().iter().position(|p| p.shape == wanted);
        found.map(Self::Planes).ok_or_else(|| {
            let shapes: Vec<String> = answering.outputs().iter().map(|p| format!("{:?}", p.shape)).collect();
            let why = format!("its outputs {} are no mask of {wanted:?}, {side} x {side} a point", shapes.join(", "));
            misfit(
                answering,
                why,
                "say `mask_side = 0` in the description where it draws no masks, or name the file that does as refine",
            )
        })
    }

    /// What draws masks of `side` rows and columns of what `search` and `head` answer, by the names of their outputs.
    pub fn refined(
        network: Box<dyn Network>,
        side: usize,
        search: &dyn Network,
        head: Option<&dyn Network>,
        points: Points,
    ) -> Result<Self> {
        let mend = "export it with inputs that are called and shaped like outputs of the search network: planes alike, and a square of places about the point";
        let cut = |input: &Port| {
            let named = |network: &dyn Network| network.outputs().iter().position(|p| p.name == input.name);
            let sources = [Some((search, false)), head.map(|h| (h, true))];
            let found = sources.into_iter().flatten().find_map(|(n, of_head)| Some((n, of_head, named(n)?)));
            let (source, of_head, output) = found.ok_or_else(|| {
                let why = format!("its input `{}` is no output of the other networks", input.name);
                misfit(&*network, why, mend)
            })?;
            match (&*source.outputs()[output].shape, &*input.shape) {
                (&[1, planes, map, across], &[1, of, side, wide])
                    if map == across && side == wide && planes == of && (1..=map).contains(&side) =>
                {
                    let step = (points.stride_px * map as f64 / points.search as f64).round().max(1.0) as usize;
                    Ok(Cut { of_head, output, planes, map, side, step })
                }
                (whole, part) => {
                    let why = format!("its input `{}` of {part:?} is no part of {whole:?}", input.name);
                    Err(misfit(&*network, why, mend))
                }
            }
        };
        let cuts = network.inputs().iter().map(cut).collect::<Result<Vec<Cut>>>()?;
        let drawn = network.outputs().first().map_or(0, Port::len);
        if drawn != side * side {
            let why = format!("it answers {drawn} numbers, and no mask of {side} x {side}");
            return Err(misfit(&*network, why, "say in the description how large its masks are: `mask_side`"));
        }
        Ok(Self::Refined { network, cuts })
    }

    /// Keeps of a search what masks are drawn of.
    pub fn keep(&self, search: &dyn Network, head: Option<&dyn Network>, kept: &mut Vec<Vec<f32>>) {
        let sources: Vec<(bool, usize)> = match self {
            Self::Planes(output) => vec![(head.is_some(), *output)],
            Self::Refined { cuts, .. } => cuts.iter().map(|cut| (cut.of_head, cut.output)).collect(),
        };
        kept.resize_with(sources.len(), Vec::new);
        for (kept, (of_head, output)) in kept.iter_mut().zip(sources) {
            kept.clear();
            kept.extend_from_slice(head.filter(|_| of_head).unwrap_or(search).output(output));
        }
    }

    /// The logits of the mask about a point of the search of which `kept` was kept.
    pub fn draw(
        &mut self,
        kept: &[Vec<f32>],
        (row, column): (usize, usize),
        answer: usize,
        drawn: &mut Vec<f32>,
    ) -> Result<()> {
        drawn.clear();
        match self {
            Self::Planes(_) => {
                let place = row * answer + column;
                let planes = kept.iter().flat_map(|kept| kept.chunks_exact(answer * answer));
                drawn.extend(planes.filter_map(|plane| plane.get(place)));
            }
            Self::Refined { network, cuts } => {
                for (i, (cut, kept)) in cuts.iter().zip(kept).enumerate() {
                    if kept.len() == cut.planes * cut.map * cut.map {
                        cut.copy(kept, (row, column), answer, network.input_mut(i));
                    }
                }
                network.run()?;
                drawn.extend_from_slice(network.output(0));
            }
        }
        Ok(())
    }

    /// The network of its own, where there is one.
    pub fn network(&self) -> Option<&dyn Network> {
        match self {
            Self::Planes(_) => None,
            Self::Refined { network, .. } => Some(&**network),
        }
    }
}

fn misfit(network: &dyn Network, why: String, mend: &str) -> InferenceError {
    InferenceError::Model { what: network.name().to_owned(), why, mend: mend.to_owned() }
}
