"""Chooses the quick tests: of every test function its first case, but for few that take long.

And what tests of several files set up before they begin.
"""

import gc
import itertools
import os
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

# Training multiplies small matrices: threads that wait for one another, beside as many processes of
# tests as there are processors, take twenty times as long. NumPy is not loaded yet.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# llvmpipe computes the same without LLVM's optimisations, and a third of the tests that ask it is
# compiling: most shaders run once, over little.
os.environ.setdefault("GALLIVM_PERF", "nopt")

# LLVM compiles vectors of four floats by a tenth faster than of eight, which the CPU would hold.
os.environ.setdefault("LP_NATIVE_VECTOR_WIDTH", "128")

# The same examples in each run, on however slow a machine: a suite that fails by chance tells
# nothing of the commit that it fails on. `pytest --hypothesis-profile=default` looks for others.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("same")

# Begun first: files of which one test, or what all its tests wait for, takes longest. A process of
# tests that has nothing left takes half of what another has left, but no part of a test.
FIRST = (
    "test_c_core.py",
    "test_same_bits.py",
    "test_stability.py",
    "test_notebooks.py",
    "test_one_text.py",
    "test_kit_run.py",
)

# What takes seconds, by file: test functions, and fixtures that do for all who ask for them.
LONG = {
    "test_bench.py": {"test_a_report_has_rates_for_the_terminal_and_ratios_for_documents"},
    "test_bounds.py": {  # an oracle of many digits, and examples by the hundred
        "test_bounds_hold_for_any_few_fragments",
        "test_bounds_of_moments_hold_what_the_oracle_finds_for_them",
    },
    "test_c_core.py": {"programs"},  # compiles the core twice
    "test_check_technique.py": {  # asks promises of many pictures
        "test_rounding_after_every_fragment_is_allowed_where_one_says_so",
        "test_the_lines_of_its_page_run",
    },
    "test_cli.py": {"test_the_demo_writes_images_curves_and_a_report"},
    "test_deep.py": {"test_truncated_files_raise_oserror_at_any_length"},
    "test_deep_bands.py": {"test_memory_is_bounded"},  # needs an image larger than memory's noise
    "test_deep_hostile.py": {"test_bands_are_as_small_as_what_is_made_is_wide"},  # a wide image
    "test_deep_killed.py": {"test_two_processes_in_one_folder_disturb_neither"},
    "test_deep_verbs.py": {"test_bands_give_the_file_of_the_whole"},
    "test_executors.py": {"test_a_cluster_of_dask_is_an_executor"},  # processes of dask
    "test_figures.py": {"test_dials_are_whole", "test_fifty_pictures_are_whole"},
    "test_fork.py": {  # wait for processes that must not hang
        "test_a_child_of_fork_does_not_hang",
        "test_a_fork_while_another_thread_writes_is_as_good",
        "test_a_grandchild_does_not_hang_nor_a_parent_afterwards",
        "test_a_pool_of_children_does_not_hang",
    },
    "test_frontier.py": {  # measure rows
        "test_a_row_has_facts_and_numbers_with_intervals",
        "test_the_scenes_are_all_that_every_technique_takes",
        "test_what_is_kept_is_not_measured_again_and_what_is_damaged_is",
    },
    "test_full_disk.py": {"test_a_disk_that_is_full_loses_no_file"},  # fills it
    "test_gpu_benchmark.py": {
        "test_a_report_names_the_device_and_what_was_timed",
        "test_what_engines_have_a_text_of_is_timed_twice",
    },
    "test_gpu_costs.py": {  # compile shaders
        "test_a_family_that_is_not_known_is_an_error",
        "test_a_text_that_is_no_glsl_is_named",
        "test_more_work_costs_more",
        "test_stored_costs_are_of_the_texts_that_there_are",
        "test_the_stored_costs_are_what_the_compiler_says",
    },
    "test_gpu_errors.py": {"test_nothing_is_kept"},  # memory grows over many calls or does not
    "test_gpu_meshes.py": {"test_pictures_of_a_million_pixels_are_summed_up_in_three_rounds"},
    "test_hostile_files.py": {  # looks at the memory of a process
        "test_an_image_that_claims_to_be_huge_is_refused_before_it_is_read",
        "test_zeros_that_deflate_to_little_are_refused_before_they_are_read",
    },
    "test_interrupt.py": {  # calls that last long enough to be interrupted
        "test_ctrl_c_is_a_keyboard_interrupt_and_moit_goes_on",
        "test_other_python_threads_run_while_a_call_lasts",
        "test_python_threads_that_call_at_once_get_equal_results",
        "test_signals_are_handled_while_a_call_lasts_and_may_stop_it",
        "test_the_core_asks_many_times_in_a_call_of_a_few_seconds",
    },
    "test_kept_techniques.py": {"test_it_is_measured_in_other_processes"},
    "test_kit_examples.py": {"test_wgpu_draws_what_moit_does"},  # starts wgpu
    "test_kit_run.py": {"test_measured_errors_are_of_the_texts_as_they_are"},  # all texts
    "test_large_coordinates.py": {"test_shadows_far_away_are_the_same"},
    "test_leaks.py": {"test_questions_of_the_surface_keep_no_memory"},  # as in test_gpu_errors.py
    "test_metrics.py": {"test_flip_agrees_with_flip_evaluator"},  # which computes for seconds
    "test_mutants.py": {"test_faults_are_found_or_survive_and_files_are_put_back"},  # runs pytest
    "test_no_memory.py": {  # run sixteen commands three times, or one again and again
        "test_commands_that_cannot_allocate_leave_whole_files_and_say_so",
        "test_who_cannot_allocate_keeps_the_old_file",
    },
    "test_notebooks.py": {"test_a_notebook_runs_and_puts_out_what_is_committed_with_it"},  # Jupyter
    "test_per_pixel.py": {  # a choice for each pixel
        "test_a_gpu_composites_what_the_cpu_chose",
        "test_bits_are_a_quarter_below_the_cheapest_single_technique_that_is_as_good",
        "test_of_pixels_that_were_not_tried_99_9_percent_are_good_enough",
        "test_predictions_are_near_what_is_measured",
    },
    "test_plot.py": {"test_labels_cover_neither_each_other_nor_markers"},  # of every size
    "test_portable.py": {"test_the_core_compiles_for_other_systems"},  # reads all of it
    "test_python_technique.py": {"test_the_example_keeps_its_promises"},
    "test_recommend.py": {  # measure all techniques
        "test_budgets_are_answered_by_what_the_frontier_names",
        "test_by_seconds_all_that_was_quicker_was_measured_to_miss",
    },
    "test_same_bits.py": {  # digests of everything, in processes of their own
        "test_neither_instructions_nor_threads_nor_what_memory_held_change_a_bit",
    },
    "test_shadows_pictures.py": {
        "test_a_technique_named_by_a_light_makes_a_map_of_the_picture",
        "test_six_moments_have_a_harder_onset_than_fifteen_coefficients",
    },
    "test_splat_gradients.py": {"test_derivatives_are_those_of_the_formulas"},  # differences
    "test_splats.py": {"test_memory_is_that_of_a_band"},  # a process
    "test_stability.py": {  # measure all techniques on many rays
        "everything",
        "of_moments",
        "test_order_changes_nothing_where_a_technique_says_so",
    },
    "test_volumes.py": {"test_a_pixel_costs_what_sorting_costs"},  # which it measures
    "test_writers.py": {"test_what_another_process_is_writing_is_not_cleared"},
}


def takes_long(item: pytest.Item) -> bool:
    asked_for = {item.originalname, *item.fixturenames}
    return not asked_for.isdisjoint(LONG.get(item.path.name, ()))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {name: n for n, name in enumerate(FIRST)}
    items.sort(key=lambda item: place.get(item.path.name, len(FIRST)))
    seen = set()
    for item in items:
        function = item.nodeid.partition("[")[0]
        if function not in seen and not takes_long(item):
            item.add_marker(pytest.mark.quick)
        seen.add(function)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    gc.disable()  # what is made for all tests stays, so that looking for garbage finds none
    try:
        return (yield)
    finally:
        gc.freeze()  # else each collection of garbage looks at all tests that are to come
        gc.enable()


@pytest.fixture
def no_two_seconds_alike(monkeypatch):
    """A clock in compare by which no two measurements last equally long.

    A test that asks whether something was measured anew looks whether its seconds have changed,
    and by the machine's own clock two short measurements are equal now and then.
    """
    readings = (n * n for n in itertools.count())
    clock = SimpleNamespace(perf_counter=lambda: float(next(readings)))
    monkeypatch.setattr("moit.comparing.measurement.time", clock)


@pytest.fixture
def trees_and_rocks(tmp_path, monkeypatch):
    """A folder of its own for what commands write, with two files to read."""
    from small import some_fragments

    import moit

    monkeypatch.chdir(tmp_path)
    moit.save("trees.npz", some_fragments())
    moit.save("rocks.npz", some_fragments(seed=5))
