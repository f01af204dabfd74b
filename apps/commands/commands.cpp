#include "apps/commands/commands.h"

namespace touchfield {

void add_commands(CLI::App& app, Invocation& invocation) {
  using Add = void (*)(CLI::App&, Invocation&);
  constexpr Add kCommands[] = {add_run_command,     add_play_command,  add_see_command,    add_fit_command,
                               add_check_command,   add_study_command, add_sweep_command,  add_info_command,
                               add_compare_command, add_hand_command,  add_mesh_command,   add_send_command,
                               add_live_command,    add_array_command, add_doctor_command, add_schema_command,
                               add_link_processes};
  for (const Add add : kCommands) {
    add(app, invocation);
  }
}

}  // namespace touchfield
