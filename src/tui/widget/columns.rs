//! Columns of a table: they have the width they need, and leave where there is no room, the least important first.

/// Describes a column.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// How wide it is at least.
    pub width: u16,
    /// What it can use beside that, where there is room to spare.
    pub extra: u16,
    /// The higher, the sooner it leaves.
    pub leaves: u8,
}

/// Is a column that is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placed {
    /// Its place among all columns.
    pub at: usize,
    /// Where it begins, from the left edge.
    pub x: u16,
    /// How wide it is.
    pub width: u16,
}

/// Chooses which columns are shown in so many columns of the terminal, and where; a gap of one is between them.
pub fn fit(specs: &[Spec], width: u16) -> Vec<Placed> {
    let mut shown: Vec<usize> = (0..specs.len()).filter(|at| specs[*at].width > 0).collect();
    let need = |shown: &[usize]| -> u16 {
        let widths = shown.iter().map(|at| specs[*at].width).fold(0_u16, u16::saturating_add);
        widths.saturating_add(u16::try_from(shown.len().saturating_sub(1)).unwrap_or(u16::MAX))
    };
    while shown.len() > 1 && need(&shown) > width {
        let Some(place) = (0..shown.len()).rev().max_by_key(|place| specs[shown[*place]].leaves) else {
            break;
        };
        shown.remove(place);
    }
    let mut spare = width.saturating_sub(need(&shown));
    let mut x = 0;
    let mut placed = Vec::new();
    for at in shown {
        let more = specs[at].extra.min(spare);
        spare -= more;
        let wide = (specs[at].width + more).min(width);
        placed.push(Placed { at, x, width: wide });
        x = x.saturating_add(wide + 1);
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_important_leaves_first_and_the_rest_is_shared_out() {
        let spec = |width, extra, leaves| Spec { width, extra, leaves };
        let specs = [spec(10, 0, 1), spec(8, 0, 9), spec(5, 100, 0)];
        let at =
            |width| fit(&specs, width).iter().map(|column| (column.at, column.width)).collect::<Vec<_>>();
        assert_eq!(at(40), [(0, 10), (1, 8), (2, 20)]);
        assert_eq!(at(20), [(0, 10), (2, 9)]);
        assert_eq!(at(3), [(2, 3)]);
    }
}
