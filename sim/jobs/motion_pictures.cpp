#include "sim/jobs/motion_pictures.h"

#include "sim/core/files.h"
#include "sim/pictures/figures.h"
#include "sim/run/motion_summary.h"
#include "sim/run/text_table.h"
#include "sim/view/view_motion.h"

namespace touchfield {

void draw_motion_page(const Motion& motion, const RunDirectory& directory, const std::string& results) {
  constexpr int kStripPictures = 6;
  constexpr std::size_t kMostBytes = std::size_t{1} << 26;
  std::string picture;
  if (!motion.instants.empty()) {
    const std::string strip = directory.file("strip.png");
    draw_motion_strip(strip, motion, some_instants(motion, kStripPictures));
    picture = read_whole_file(strip, kMostBytes);
  }
  write_text_file(directory.file("report.html"), motion_page(motion, picture, results));
}

}  // namespace touchfield
