#pragma once

namespace CLI {
class App;
}

namespace touchfield {

struct Invocation;

/// Adds every command to the program, in the order that --help lists them; they must not outlive `invocation`.
///
/// A command is a function that adds its options and its action (finish_command), and a row in commands.cpp with its
/// group and examples for help. Small commands of a group are one file, GROUP_commands.cpp.
void add_commands(CLI::App& app, Invocation& invocation);

void add_array_command(CLI::App& app, Invocation& invocation);
void add_check_command(CLI::App& app, Invocation& invocation);
void add_compare_command(CLI::App& app, Invocation& invocation);
void add_doctor_command(CLI::App& app, Invocation& invocation);
void add_hand_command(CLI::App& app, Invocation& invocation);
void add_info_command(CLI::App& app, Invocation& invocation);
void add_init_command(CLI::App& app, Invocation& invocation);
void add_link_guard(CLI::App& app, Invocation& invocation);  // hidden: a link's guard
void add_live_command(CLI::App& app, Invocation& invocation);
void add_mesh_command(CLI::App& app, Invocation& invocation);
void add_pattern_command(CLI::App& app, Invocation& invocation);
void add_play_command(CLI::App& app, Invocation& invocation);
void add_run_command(CLI::App& app, Invocation& invocation);
void add_schema_command(CLI::App& app, Invocation& invocation);
void add_see_command(CLI::App& app, Invocation& invocation);
void add_fit_command(CLI::App& app, Invocation& invocation);
void add_send_command(CLI::App& app, Invocation& invocation);
void add_study_command(CLI::App& app, Invocation& invocation);
void add_sweep_command(CLI::App& app, Invocation& invocation);
void add_felt_command(CLI::App& app, Invocation& invocation);
void add_view_command(CLI::App& app, Invocation& invocation);

}  // namespace touchfield
