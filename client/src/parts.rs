//! Assembles the parts of a fetch into the specification, result and history of a job.

use osteon_common::job::DRAWS_MAX;
use osteon_common::limits::{DRAWS_ALL_MAX, GROUPS_MAX, REALIZATIONS_MAX};
use osteon_common::outcome::Outcome;
use osteon_common::posterior::PosteriorDraw;
use osteon_common::results::{Evaluation, SetSamples};
use osteon_files::report::{Group, PosteriorReport, ReadError, ResultFile};
use osteon_proto::choice::JOB_STATUS;
use osteon_proto::malformed::Malformed;
use osteon_proto::v1::fetch_response::Part;
use osteon_proto::v1::{self, DrawBlock, RealizationBlock};
use osteon_proto::{draws, history, realizations, specification};

use crate::fetched::Fetched;

/// The parts received so far.
#[derive(Debug, Default)]
pub(crate) struct FetchedParts {
    specification: Option<v1::JobSpecification>,
    result: Option<v1::JobResult>,
    history: Vec<Evaluation>,
    /// The outcomes at the best point of the job.
    realizations: PointOutcomes,
    /// The draws from the posterior of the job.
    draws: Vec<PosteriorDraw>,
    groups: Vec<FetchedGroup>,
    /// Number of outcomes of groups that were kept.
    kept: u64,
    /// Number of draws received.
    drawn: u64,
}

/// A group with the blocks that followed it.
#[derive(Debug)]
struct FetchedGroup {
    message: v1::GroupResult,
    realizations: PointOutcomes,
    draws: Vec<PosteriorDraw>,
}

/// The outcomes of one point.
#[derive(Debug, Default)]
struct PointOutcomes {
    /// Number of outcomes received.
    count: u64,
    /// All outcomes received, or none if there are too many.
    outcomes: Vec<Outcome>,
}

impl FetchedParts {
    /// Adds the next part.
    pub(crate) fn add(&mut self, part: Part) -> Result<(), Malformed> {
        match part {
            Part::Specification(specification) => self.specification = Some(specification),
            Part::Result(result) => self.result = Some(result),
            Part::History(block) => {
                for row in &block.rows {
                    self.history.push(history::evaluation_from_message(row)?);
                }
            }
            Part::Group(group) => {
                let next = self.groups.len();
                if group.group as usize != next || next == GROUPS_MAX {
                    let allowed = "groups must follow each other, at most 1000";
                    return Err(out_of_range("group", group.group.into(), allowed));
                }
                let (realizations, draws) = (PointOutcomes::default(), Vec::new());
                self.groups.push(FetchedGroup { message: group, realizations, draws });
            }
            Part::Realizations(block) => self.add_realizations(&block)?,
            Part::Draws(block) => self.add_draws(&block)?,
        }
        Ok(())
    }

    fn add_realizations(&mut self, block: &RealizationBlock) -> Result<(), Malformed> {
        let (first, outcomes) = realizations::from_message(block)?;
        let (of_point, keeps) = match (block.group, self.groups.last_mut()) {
            (None, _) => (&mut self.realizations, true),
            (Some(group), Some(found)) if found.message.group == group => {
                self.kept += outcomes.len() as u64;
                (&mut found.realizations, self.kept <= REALIZATIONS_MAX)
            }
            (Some(group), _) => {
                let allowed = "realizations must follow the result of their group";
                return Err(out_of_range("group", group.into(), allowed));
            }
        };
        let count = of_point.count + outcomes.len() as u64;
        if first != of_point.count || count > REALIZATIONS_MAX {
            let allowed = "blocks of realizations must follow each other";
            return Err(out_of_range("first", first as f64, allowed));
        }
        of_point.count = count;
        if keeps {
            of_point.outcomes.extend(outcomes);
        } else {
            of_point.outcomes = Vec::new();
        }
        Ok(())
    }

    fn add_draws(&mut self, block: &DrawBlock) -> Result<(), Malformed> {
        let (first, draws) = draws::draws_from_message(block)?;
        let of_set = match (block.group, self.groups.last_mut()) {
            (None, _) => &mut self.draws,
            (Some(group), Some(found)) if found.message.group == group => &mut found.draws,
            (Some(group), _) => {
                let allowed = "draws must follow the result of their group";
                return Err(out_of_range("group", group.into(), allowed));
            }
        };
        let count = of_set.len() as u64 + draws.len() as u64;
        self.drawn += draws.len() as u64;
        if first != of_set.len() as u64 || count > DRAWS_MAX || self.drawn > DRAWS_ALL_MAX {
            let allowed =
                "blocks of draws must follow each other, up to 20 000 draws of a posterior";
            return Err(out_of_range("first", first as f64, allowed));
        }
        of_set.extend(draws);
        Ok(())
    }

    /// Assembles the parts once all have arrived.
    pub(crate) fn assemble(self) -> Result<Fetched, Malformed> {
        let specification =
            self.specification.ok_or(Malformed::Missing { field: "specification" })?;
        let specification =
            specification::from_message(&specification).map_err(Malformed::InvalidSpecification)?;
        let message = self.result.ok_or(Malformed::Missing { field: "result" })?;
        let status = JOB_STATUS.required(message.status, "status")?;
        let mut result = ResultFile::from_json(&message.json).map_err(malformed_result)?;
        if result.kind() != specification.kind {
            let (found, kind) = (result.kind().name(), specification.kind.name());
            let reason = format!("it is the result of a {found}, and the job is a {kind}");
            return Err(Malformed::Json { field: "json", reason });
        }
        let all = result.realizations();
        let of_job = SetSamples {
            outcomes: self.realizations.assemble(result.best_point(None).is_ok(), all)?,
            draws: check_draws(self.draws, result.posterior())?,
        };
        let (mut groups, mut samples) = (Vec::new(), Vec::new());
        for FetchedGroup { message, realizations, draws } in self.groups {
            let group = Group::from_json(&message.json).map_err(malformed_result)?;
            samples.push(SetSamples {
                outcomes: realizations.assemble(group.best_point().is_some(), all)?,
                draws: check_draws(draws, group.posterior.as_ref())?,
            });
            groups.push(group);
        }
        if groups.is_empty() {
            samples.push(of_job);
        } else if let ResultFile::Identification(found) = &mut result {
            found.set_groups(groups);
        }
        let Self { history, .. } = self;
        Ok(Fetched { specification, status, reason: message.reason, result, history, samples })
    }
}

impl PointOutcomes {
    /// Returns the outcomes, whose number must be `all` if there is a best point, and 0 otherwise.
    fn assemble(self, has_best: bool, all: u64) -> Result<Vec<Outcome>, Malformed> {
        let expected = if has_best { all } else { 0 };
        require_length("realizations", self.count, expected)?;
        Ok(self.outcomes)
    }
}

/// Returns the draws, of which there must be as many as the posterior says.
fn check_draws(
    draws: Vec<PosteriorDraw>,
    posterior: Option<&PosteriorReport>,
) -> Result<Vec<PosteriorDraw>, Malformed> {
    require_length("draws", draws.len() as u64, posterior.map_or(0, |posterior| posterior.draws))?;
    Ok(draws)
}

fn require_length(field: &'static str, found: u64, expected: u64) -> Result<(), Malformed> {
    if found == expected {
        return Ok(());
    }
    let number = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    let (found, expected) = (number(found), number(expected));
    Err(Malformed::WrongLength { field, found, expected })
}

fn malformed_result(error: ReadError) -> Malformed {
    Malformed::Json { field: "json", reason: error.to_string() }
}

fn out_of_range(field: &'static str, value: f64, allowed: &'static str) -> Malformed {
    Malformed::OutOfRange { field, value, allowed }
}

#[cfg(test)]
mod tests;
