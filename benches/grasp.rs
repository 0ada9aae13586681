//! What a step of a tool change costs; items are steps of a millisecond.
use calamus::skill::HandCommand;
use calamus::tool::ToolSet;
use calamus::twin::grasp::{DockError, ErrorRanges, TrialSetup};
use divan::Bencher;
use divan::counter::ItemsCount;

fn main() {
    divan::main();
}

const STEPS: u32 = 1000;

fn setup() -> TrialSetup {
    TrialSetup::gantry(ToolSet::pen_tool().expect("the given tool can be read"))
}

/// A pick and a return with errors, all stages.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn tool_change(bencher: Bencher) {
    let setup = setup();
    let error = ErrorRanges::usual().draw(&mut calamus::math::stream(3, "dock error", 0));
    let steps = setup.run(&error).expect("stays finite").steps;
    bencher.counter(ItemsCount::new(steps)).bench_local(|| setup.run(&error));
}

/// An open hand before a tool that is at rest in its dock.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn before_the_dock(bencher: Bencher) {
    let setup = setup();
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| setup.world(&DockError::default()).expect("can be built").0)
        .bench_local_values(|mut world| {
            let grip = setup.options.ready(&setup.world_from_dock);
            for _ in 0..STEPS {
                world.step(&grip, &HandCommand::open()).expect("stays finite");
            }
        });
}

/// A tool held over its dock.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn holding(bencher: Bencher) {
    let setup = setup();
    bencher
        .counter(ItemsCount::new(STEPS))
        .with_inputs(|| setup.pick(&DockError::default()).expect("can be picked"))
        .bench_local_values(|mut picked| picked.hold(STEPS));
}
