//! The page of a robot: its links and obstacles, the lines of the file, and the answers about edges.

use super::{Answer, Asked, Question, RobotArguments};
use crate::asking::files::refuse_overwriting;
use crate::console::{self, Failure, shown};
use crate::view::output::{self, refuse_standard_output};
use bvh_query::Pose;
use cbvh_robot::Robot;
use cbvh_view::{Page, RobotLine};
use std::path::PathBuf;

/// Refuses outputs that would replace an input or each other, and options without what they are about.
pub(super) fn check(arguments: &RobotArguments, obstacles: &[(PathBuf, Pose)]) -> Result<(), Failure> {
    let RobotArguments { urdf, srdf, file, edges, out, bench, run, .. } = arguments;
    if !arguments.asks() && (*edges || *bench || run.json || out.is_some()) {
        return Err(Failure::usage("--edges, --json, --bench and --out require FILE"));
    }
    match &arguments.view {
        Some(page) => refuse_standard_output("--view", page)?,
        None if arguments.page.is_given() => return Err(Failure::usage("--max-page requires --view")),
        None => {}
    }
    let inputs = [urdf].into_iter().chain(srdf).chain(file).chain(obstacles.iter().map(|(path, _)| path));
    refuse_overwriting(arguments.view.iter().chain(out), inputs)
}

/// Refuses a page that is too large, before questions are asked.
pub(super) fn refuse_large(robot: &mut Robot, arguments: &RobotArguments) -> Result<(), Failure> {
    if arguments.view.is_none() {
        return Ok(());
    }
    page(robot, arguments, []).map(drop)
}

/// Writes the page, if there is to be one.
pub(super) fn write<'a>(
    robot: &mut Robot,
    arguments: &RobotArguments,
    answered: impl IntoIterator<Item = (&'a Question, &'a Answer)>,
) -> Result<(), Failure> {
    let Some(path) = &arguments.view else { return Ok(()) };
    output::write(&page(robot, arguments, answered)?, path)
}

/// Writes the page of a robot that is asked nothing, and says so.
pub(super) fn write_alone(robot: &mut Robot, arguments: &RobotArguments) -> Result<(), Failure> {
    write(robot, arguments, [])?;
    let page = arguments.view.iter().map(|page| page.display().to_string()).collect::<String>();
    console::text(&(shown(&format!("{page}: shows {}", arguments.urdf.display())) + "\n"))
}

fn page<'a>(
    robot: &mut Robot,
    arguments: &RobotArguments,
    answered: impl IntoIterator<Item = (&'a Question, &'a Answer)>,
) -> Result<Page, Failure> {
    let lines = answered.into_iter().map(|(question, answer)| match (&question.asked, answer) {
        (Asked::Configuration(joints), _) => RobotLine { start: joints.clone(), edge: None },
        (Asked::Edge(edge), answer) => {
            let [start, goal] = edge.ends();
            let motion = if let Answer::Motion(motion) = answer { Some(motion) } else { None };
            RobotLine { start, edge: motion.map(|motion| (goal, motion)) }
        }
    });
    arguments.page.limit(Page::of_robot(robot, lines).map_err(Failure::from_page)?)
}
