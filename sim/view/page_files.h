#pragma once

/// The viewer's files as they are in the folder page/.
namespace touchfield {

extern const char* const kViewerScript;
extern const char* const kPartsScript;
extern const char* const kPageScript;
extern const char* const kPageStyle;

}  // namespace touchfield
