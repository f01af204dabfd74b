#include "sim/view/view_page.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/run/run_text.h"
#include "sim/view/page_files.h"
#include "sim/view/page_values.h"

namespace touchfield {

namespace {

/// Nothing is fetched but what the page itself serves.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'";

/// JSON within a script element.
std::string script_text(const Json& json) {
  std::string text;
  for (const char c : json_text(json)) {
    c == '<' ? text.append("\\u003c") : text.append(1, c);
  }
  return text;
}

}  // namespace

std::string view_page(const ViewData& data, const std::string& picture, const std::string& below,
                      const std::string& live) {
  const std::string title = markup_text(data.title);
  const std::string image =
      picture.empty() ? "" : fmt::format("<img src=\"data:image/png;base64,{}\" alt=\"{}\"/>", base64(picture), title);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>{}</title>\n<style>{}</style></head>\n<body>\n<h1>{}</h1>\n"
      "<section id=\"view\"></section>\n<div id=\"instead\" hidden><p></p>{}</div>\n"
      "<script type=\"application/json\" id=\"data\">{}</script>\n"
      "<script>{}{}{}</script>\n{}</body>\n</html>\n",
      kPolicy, title, kPageStyle, title, image, script_text(page_json(data, live)), kViewerScript, kPartsScript,
      kPageScript, below);
}

}  // namespace touchfield
