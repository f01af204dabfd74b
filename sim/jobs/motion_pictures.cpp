#include "sim/jobs/motion_pictures.h"

#include "sim/core/files.h"
#include "sim/pictures/figures.h"
#include "sim/run/text_table.h"
#include "sim/view/view_motion.h"

namespace touchfield {

void draw_motion_page(const Motion& motion, const RunDirectory& directory, const std::string& results) {
  const std::string strip = motion_strip(motion);
  if (!strip.empty()) {
    write_atomically(directory.file("strip.png"), {strip});
  }
  write_text_file(directory.file("report.html"), motion_page(motion, strip, results));
}

}  // namespace touchfield
