//! Rules on pooling the results of groups.

use crate::group_settings::GroupSettings;
use crate::inference::PARTS_MIN;
use crate::job::{JobKind, JobSpecification};
use crate::pooling::POOLED_MIN;
use crate::violations::Violations;

use super::value::known_wrong;

/// Checks that groups are pooled only where this says something. A propagation has no data, and ignores it.
pub(super) fn pooled_groups(specification: &JobSpecification, violations: &mut Violations) {
    let field = format!("{}.{}", GroupSettings::KEY.name, GroupSettings::POOLED);
    let asks = specification.groups.pooled && specification.kind == JobKind::Identification;
    if !asks || known_wrong(&field, violations) || violations.has_at_or_below("data") {
        return;
    }
    let Some(data) = &specification.data else { return };
    if !data.is_grouped() {
        let message = "is true, and the data are not grouped; set data.group to the column that names the groups, \
                       or leave it out";
        return violations.add(field, message);
    }
    let parts = |set: usize| data.set(set).map_or(0, |velocities| velocities.independent_count());
    let enough = |set: &usize| parts(*set) as u64 >= PARTS_MIN;
    let count = (0..data.sets()).filter(enough).count();
    if count < POOLED_MIN {
        let message = format!(
            "is true, and {count} of the groups {} at least {PARTS_MIN} velocities, or subjects; the scatter between \
             groups cannot be told from fewer than {POOLED_MIN} of them: leave it out",
            if count == 1 { "has" } else { "have" }
        );
        return violations.add(field, message);
    }
    if !specification.is_searched() {
        let message = "is true, and search.method is \"posterior\"; pooling needs the best point of a search: set it \
                       to \"newton\", or leave one of them out";
        violations.add(field, message);
    } else if !specification.search.sensitivities {
        let message = "is true, and search.sensitivities is false; pooling needs the derivatives: leave one of them \
                       out";
        violations.add(field, message);
    }
}
