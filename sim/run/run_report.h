#pragma once

#include <string>
#include <vector>

#include "sim/run/run_data.h"

namespace touchfield {

/// A page in HTML about a run. It has pictures, the figures of each method, what to cite (BibTeX), warnings and
/// provenance. A paragraph for the methods section of a paper has all settings that matter.
///
/// pictures   names of files beside the page; of planes and setup those that are there
std::string run_report(const Run& run, const std::vector<std::string>& pictures);

/// The paragraph alone, as plain text.
std::string methods_paragraph(const Run& run);

/// This version of touchfield, and the paper on which its method is based.
std::string bibtex(const std::string& version);

}  // namespace touchfield
