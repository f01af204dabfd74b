#include "sim/pictures/picture_format.h"

namespace touchfield {

std::string to_string(PictureFormat format) {
  switch (format) {
    case PictureFormat::kPdf:
      return "pdf";
    case PictureFormat::kSvg:
      return "svg";
    case PictureFormat::kPng:
      break;
  }
  return "png";
}

}  // namespace touchfield
