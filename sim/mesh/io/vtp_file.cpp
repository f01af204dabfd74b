#include <algorithm>
#include <array>
#include <cmath>
#include <expat.h>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataWriter.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/text_cursor.h"
#include "sim/mesh/io/vtp_array.h"

namespace touchfield {

namespace {

/// What the XML says of one piece; its arrays by "Points", "Polys/connectivity" and so on.
struct Piece {
  std::map<std::string, std::string, std::less<>> counts;
  std::map<std::string, VtpArray, std::less<>> arrays;
};

struct Document {
  VtpEncoding encoding;
  std::vector<Piece> pieces;
  std::optional<VtpAppendedData> appended;
};

/// Goes through the XML up to the appended data, which need not be XML.
class DocumentReader {
 public:
  DocumentReader(const std::string& content, const std::string& name) : content_(content), name_(name) {}

  Document read() {
    const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr),
                                                                              &XML_ParserFree);
    if (!parser) {
      throw InputError(fmt::format("{}: no memory to read it", name_));
    }
    parser_ = parser.get();
    XML_SetUserData(parser_, this);
    XML_SetElementHandler(parser_, on_start, on_end);
    XML_SetCharacterDataHandler(parser_, on_text);
    constexpr std::size_t kChunk = std::size_t{1} << 26U;
    XML_Status status = XML_STATUS_OK;
    for (std::size_t at = 0; at < content_.size() && status == XML_STATUS_OK; at += kChunk) {
      const std::size_t size = std::min(kChunk, content_.size() - at);
      status = XML_Parse(parser_, content_.data() + at, static_cast<int>(size), at + size == content_.size() ? 1 : 0);
    }
    if (!error_.empty()) {
      throw InputError(fmt::format("{}:{}: {}", name_, line_, error_));
    }
    if (status != XML_STATUS_OK && !document_.appended) {
      throw InputError(fmt::format("{}:{}: not whole XML: {}", name_, XML_GetCurrentLineNumber(parser_),
                                   XML_ErrorString(XML_GetErrorCode(parser_))));
    }
    if (document_.pieces.empty()) {
      throw InputError(fmt::format("{}: the file has no Piece of PolyData", name_));
    }
    return std::move(document_);
  }

 private:
  static void on_start(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<DocumentReader*>(self)->start(name, attributes);
  }
  static void on_end(void* self, const XML_Char* /*name*/) { static_cast<DocumentReader*>(self)->end(); }
  static void on_text(void* self, const XML_Char* text, int size) {
    static_cast<DocumentReader*>(self)->add_text({text, static_cast<std::size_t>(size)});
  }

  static std::string attribute(const XML_Char** attributes, std::string_view name, const char* otherwise = "") {
    for (; *attributes != nullptr; attributes += 2) {
      if (name == *attributes) {
        return attributes[1];
      }
    }
    return otherwise;
  }

  /// Ends the parsing; errors must not be thrown through the parser.
  void stop(const std::string& error) {
    error_ = error;
    line_ = XML_GetCurrentLineNumber(parser_);
    XML_StopParser(parser_, XML_FALSE);
  }

  void start(std::string_view name, const XML_Char** attributes) {
    constexpr std::size_t kDeepest = 100;  // a surface needs 5
    if (path_.empty()) {
      start_file(name, attributes);
    } else if (path_.size() == kDeepest) {
      stop(fmt::format("its XML is nested deeper than {} elements", kDeepest));
    } else if (name == "AppendedData" && path_.size() == 1) {
      start_appended(attributes);
    } else if (name == "Piece" && path_.size() == 2 && path_.back() == "PolyData") {
      Piece& piece = document_.pieces.emplace_back();
      for (const char* count : {"NumberOfPoints", "NumberOfPolys", "NumberOfStrips"}) {
        piece.counts[count] = attribute(attributes, count, "0");
      }
    } else if (name == "DataArray" && path_.size() == 4 && path_[1] == "PolyData" && path_[2] == "Piece") {
      start_array(attributes);
    }
    path_.emplace_back(name);
  }

  void start_file(std::string_view name, const XML_Char** attributes) {
    const std::string type = attribute(attributes, "type");
    const std::string order = attribute(attributes, "byte_order", "LittleEndian");
    const std::string header = attribute(attributes, "header_type", "UInt32");
    const std::string compressor = attribute(attributes, "compressor");
    if (name != "VTKFile") {
      return stop(fmt::format("not a VTK file: its XML begins with '{}', not with 'VTKFile'", name.substr(0, 40)));
    }
    if (type != "PolyData") {
      return stop(fmt::format("a VTK file of type '{}', it must be PolyData", type.substr(0, 40)));
    }
    if (order != "LittleEndian" && order != "BigEndian") {
      return stop(fmt::format("byte_order is '{}', it must be LittleEndian or BigEndian", order.substr(0, 40)));
    }
    if (header != "UInt32" && header != "UInt64") {
      return stop(fmt::format("header_type is '{}', it must be UInt32 or UInt64", header.substr(0, 40)));
    }
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
      return stop(fmt::format("compressor '{}' is not supported, only vtkZLibDataCompressor or none",
                              compressor.substr(0, 40)));
    }
    document_.encoding = {order == "BigEndian", header == "UInt64", !compressor.empty()};
  }

  void start_appended(const XML_Char** attributes) {
    const std::string encoding = attribute(attributes, "encoding", "base64");
    if (encoding != "raw" && encoding != "base64") {
      return stop(fmt::format("AppendedData has the encoding '{}', it must be raw or base64", encoding.substr(0, 40)));
    }
    const auto tag = static_cast<std::size_t>(XML_GetCurrentByteIndex(parser_)) +
                     static_cast<std::size_t>(XML_GetCurrentByteCount(parser_));
    const std::size_t mark = content_.find_first_not_of(" \t\r\n", tag);
    if (mark == std::string::npos || content_[mark] != '_') {
      return stop("AppendedData must begin with an underscore");
    }
    std::string_view bytes = std::string_view(content_).substr(mark + 1);
    if (encoding == "base64") {
      bytes = bytes.substr(0, bytes.find('<'));
    }
    document_.appended = {bytes, encoding == "base64"};
    XML_StopParser(parser_, XML_FALSE);
  }

  void start_array(const XML_Char** attributes) {
    const std::string& parent = path_.back();
    std::string key = parent;
    if (parent == "Points") {
      if (attribute(attributes, "NumberOfComponents") != "3") {
        return stop("Points must have 3 components");
      }
    } else if (parent == "Polys" || parent == "Strips") {
      key += "/" + attribute(attributes, "Name");
    } else {
      return;
    }
    const auto [place, is_new] = document_.pieces.back().arrays.try_emplace(key);
    if (!is_new) {
      return stop(fmt::format("a second array '{}' in one piece", key.substr(0, 40)));
    }
    place->second = {attribute(attributes, "type"), attribute(attributes, "format", "ascii"),
                     attribute(attributes, "offset"), ""};
    array_ = &place->second;
  }

  void add_text(std::string_view text) {
    if (array_ != nullptr && path_.size() == 5) {
      array_->text += text;
    }
  }

  void end() {
    path_.pop_back();
    if (path_.size() == 4) {
      array_ = nullptr;
    }
  }

  const std::string& content_;
  const std::string& name_;
  XML_Parser parser_ = nullptr;
  std::vector<std::string> path_;
  VtpArray* array_ = nullptr;  // that the text belongs to
  Document document_;
  std::string error_;
  XML_Size line_ = 0;
};

/// Turns the arrays of a document into a surface.
class SurfaceReader {
 public:
  SurfaceReader(const Document& document, const std::string& name) : document_(document), name_(name) {}

  FileSurface read() {
    for (const Piece& piece : document_.pieces) {
      add_piece(piece);
    }
    add_polygons(surface_, polygons_, name_);
    return std::move(surface_);
  }

 private:
  void add_piece(const Piece& piece) {
    const auto first = static_cast<std::int64_t>(surface_.points.size());
    if (const std::int64_t count = count_of(piece, "NumberOfPoints"); count > 0) {
      require_few(first + count, 0, name_);
      add_points(piece, count);
    }
    const std::int64_t points = static_cast<std::int64_t>(surface_.points.size()) - first;
    for_each_cell(piece, "Polys", points, [&](const std::int64_t* begin, const std::int64_t* end) {
      std::vector<std::int64_t>& polygon = polygons_.emplace_back(begin, end);
      std::for_each(polygon.begin(), polygon.end(), [&](std::int64_t& corner) { corner += first; });
    });
    for_each_cell(piece, "Strips", points, [&](const std::int64_t* begin, const std::int64_t* end) {
      std::vector<std::int64_t> corners(begin, end);
      std::for_each(corners.begin(), corners.end(), [&](std::int64_t& corner) { corner += first; });
      add_strip(polygons_, corners);
    });
  }

  std::int64_t count_of(const Piece& piece, const char* name) const {
    const std::string& word = piece.counts.at(name);
    std::int64_t count = 0;
    if (!to_integer(word, count) || count < 0) {
      throw InputError(
          fmt::format("{}: {} is '{}', it must be a whole number from 0", name_, name, word.substr(0, 40)));
    }
    require_few(count, 0, name_);  // so that sums of counts stay numbers
    return count;
  }

  const VtpArray& array_of(const Piece& piece, const std::string& key) const {
    const auto found = piece.arrays.find(key);
    if (found == piece.arrays.end()) {
      throw InputError(fmt::format("{}: a piece has no array {}", name_, key));
    }
    return found->second;
  }

  void add_points(const Piece& piece, std::int64_t count) {
    const std::string what = name_ + ": Points";
    const std::vector<double> values =
        decode<double>(array_of(piece, "Points"), document_.encoding, document_.appended, 3 * count, what);
    if (values.size() % 3 != 0 || static_cast<std::int64_t>(values.size() / 3) != count) {
      throw InputError(fmt::format("{}: there are {} coordinates for {} points", what, values.size(), count));
    }
    for (std::size_t i = 0; i < values.size(); i += 3) {
      const Vector3 point(values[i], values[i + 1], values[i + 2]);
      if (!point.allFinite()) {
        throw InputError(fmt::format("{}: point {} has a coordinate that is not a finite number ({}, {}, {})", what,
                                     i / 3, point.x(), point.y(), point.z()));
      }
      surface_.points.push_back(point);
    }
  }

  /// Calls `add` with the corners of every cell of a kind.
  template <class Add>
  void for_each_cell(const Piece& piece, const std::string& kind, std::int64_t points, const Add& add) {
    const std::int64_t count = count_of(piece, ("NumberOf" + kind).c_str());
    if (count == 0) {
      return;
    }
    require_few(0, static_cast<std::int64_t>(polygons_.size()) + count, name_);
    const auto integers = [&](const std::string& key, std::int64_t most) {
      return decode<std::int64_t>(array_of(piece, key), document_.encoding, document_.appended, most,
                                  name_ + ": " + key);
    };
    const std::vector<std::int64_t> corners = integers(kind + "/connectivity", kMostFileCorners - corners_);
    const std::vector<std::int64_t> ends = integers(kind + "/offsets", count);
    const auto size = static_cast<std::int64_t>(corners.size());
    corners_ += size;
    if (static_cast<std::int64_t>(ends.size()) != count || ends.back() != size) {
      throw InputError(fmt::format("{}: {} cells are announced; there are {} offsets up to {} and {} corners in all",
                                   name_ + ": " + kind, count, ends.size(), ends.empty() ? 0 : ends.back(), size));
    }
    for (const std::int64_t corner : corners) {
      if (corner < 0 || corner >= points) {
        throw InputError(fmt::format("{}: {}: a corner is point {}, but the piece has {} points (the first is 0)",
                                     name_, kind, corner, points));
      }
    }
    std::int64_t begin = 0;
    for (const std::int64_t end : ends) {
      if (end < begin || end > size) {
        throw InputError(fmt::format("{}: {}: the offset {} follows {}, of {} corners", name_, kind, end, begin, size));
      }
      add(corners.data() + begin, corners.data() + end);
      begin = end;
    }
  }

  const Document& document_;
  const std::string& name_;
  FileSurface surface_;
  std::vector<std::vector<std::int64_t>> polygons_;
  std::int64_t corners_ = 0;  // of all cells so far
};

}  // namespace

FileSurface parse_vtp(const std::string& content, const std::string& name) {
  const Document document = DocumentReader(content, name).read();
  return SurfaceReader(document, name).read();
}

std::string as_vtp(const TriangleMesh& mesh, double unit) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& vertex : mesh.vertices().colwise()) {
    points->InsertNextPoint(vertex.x() / unit, vertex.y() / unit, vertex.z() / unit);
  }
  vtkNew<vtkCellArray> faces;
  for (const auto& triangle : mesh.triangles().colwise()) {
    faces->InsertNextCell({triangle(0), triangle(1), triangle(2)});
  }
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(points);
  surface->SetPolys(faces);
  // Inline binary: ParaView 5.11 of Debian 12 cannot open the appended mode that is the writer's default.
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surface);
  writer->SetDataModeToBinary();
  writer->SetCompressorTypeToZLib();
  writer->WriteToOutputStringOn();
  if (writer->Write() != 1) {
    throw IoError("the mesh could not be encoded as VTP");
  }
  return writer->GetOutputString();
}

}  // namespace touchfield
