#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sim/core/errors.h"

namespace touchfield {

/// The C interface of the AUTD3 vendor's library, version 38, as far as it is used here. Lengths are in mm, single
/// precision. What makes an object hands it over; what takes a Gain, ModulationData, Datagram or Link keeps it. A
/// Sender serves for any number of messages, until its controller closes; nothing frees it.
///
/// source   pyautd3 38.0.1, the types it declares for its own calls
namespace autd3 {

// Never looked into, only passed on.
struct Controller;
struct Datagram;
struct Device;
struct FpgaStates;
struct Gain;
struct Geometry;
struct Link;
struct ModulationData;
struct Sender;
struct Transducer;

struct Point {
  float x, y, z;
};

struct Quaternion {
  float w, i, j, k;
};

struct Drive {
  std::uint8_t phase;
  std::uint8_t intensity;
};

struct OptionalDuration {
  bool has_value;
  std::uint64_t nanoseconds;
};

struct SenderOption {
  OptionalDuration send_interval;
  OptionalDuration receive_interval;
  OptionalDuration timeout;
};

struct SamplingConfig {
  std::uint8_t tag;
  std::uint64_t value;  // the library's union
};

struct CompletionSteps {
  std::uint16_t intensity;
  std::uint16_t phase;
  bool strict;
};

/// A value, or if error_length > 0 an error to be fetched with take_error, once.
template <class T>
struct Result {
  T value;
  std::uint32_t error_length;
  const void* error;
};

/// Called from the library's own threads, several at a time, while a gain is sent.
using DriveOf = void (*)(const void* context, const Geometry* geometry, std::uint16_t device, std::uint8_t transducer,
                         Drive* drive);

/// The functions of a library that was loaded.
class Symbols {
 public:
  /// throws   InputError if the file cannot be loaded
  explicit Symbols(std::string file);

  struct Symbol {
    void* address;
    template <class Function>
    operator Function*() const {  // NOLINT(google-explicit-constructor): the pointer that takes it says which
      return reinterpret_cast<Function*>(address);
    }
  };
  /// throws   InputError if it has no such function
  Symbol operator()(const char* name) const;

 private:
  std::string file_;
  void* handle_;
};

struct Calls {
  Symbols find;

  void (*take_error)(const void* error, char* text) = find("AUTDGetErr");
  void (*latest_firmware)(char* text) = find("AUTDFirmwareLatest");  // 256 bytes

  Result<Controller*> (*open)(const Point* positions, const Quaternion* rotations, std::uint16_t devices, Link* link,
                              SenderOption option) = find("AUTDControllerOpen");
  Result<std::uint8_t> (*close)(Controller*) = find("AUTDControllerClose");
  Link* (*link_of)(Controller*) = find("AUTDLinkGet");
  bool (*is_default)(SenderOption) = find("AUTDSenderOptionIsDefault");
  void (*set_default)(Controller*, SenderOption) = find("AUTDSetDefaultSenderOption");
  Sender* (*sender)(Controller*, SenderOption) = find("AUTDSender");
  Result<std::uint8_t> (*send)(Sender*, Datagram*) = find("AUTDSenderSend");

  Result<FpgaStates*> (*fpga_states)(Controller*) =
      find("AUTDControllerFPGAState");  // looks for answers of the units, and changes nothing
  void (*delete_fpga_states)(FpgaStates*) = find("AUTDControllerFPGAStateDelete");

  Geometry* (*geometry)(Controller*) = find("AUTDGeometry");
  std::uint32_t (*device_count)(Geometry*) = find("AUTDGeometryNumDevices");
  Device* (*device)(Geometry*, std::uint16_t index) = find("AUTDDevice");
  std::uint32_t (*transducer_count)(Device*) = find("AUTDDeviceNumTransducers");
  Point (*axis)(Device*) = find("AUTDDeviceDirectionAxial");
  Transducer* (*transducer)(Device*, std::uint8_t index) = find("AUTDTransducer");
  Point (*position)(Transducer*) = find("AUTDTransducerPosition");

  Gain* (*custom_gain)(DriveOf drive_of, const void* context, Geometry*) = find("AUTDGainCustom");
  Gain* (*null_gain)() = find("AUTDGainNull");
  Datagram* (*gain_datagram)(Gain*) = find("AUTDGainIntoDatagram");
  SamplingConfig (*sampling_of_divider)(std::uint16_t divider) = find("AUTDSamplingConfigFromDivide");
  ModulationData* (*custom_modulation)(const std::uint8_t* samples, std::uint16_t count,
                                       SamplingConfig) = find("AUTDModulationCustom");
  Datagram* (*modulation_datagram)(ModulationData*) = find("AUTDModulationIntoDatagram");
  Datagram* (*silencer_datagram)(CompletionSteps) = find("AUTDDatagramSilencerFromCompletionSteps");

  Link* (*nop_link)() = find("AUTDLinkNop");
  Link* (*audit_link)() = find("AUTDLinkAudit");
  void (*audit_break)(Link*) = find("AUTDLinkAuditBreakDown");
  std::uint8_t (*audit_gain_segment)(Link*, std::uint16_t device) = find("AUTDLinkAuditFpgaCurrentStmSegment");
  std::uint8_t (*audit_modulation_segment)(Link*, std::uint16_t device) = find("AUTDLinkAuditFpgaCurrentModSegment");
  std::uint32_t (*audit_transducer_count)(Link*, std::uint16_t device) = find("AUTDLinkAuditCpuNumTransducers");
  void (*audit_drives)(Link*, std::uint8_t segment, std::uint16_t device, std::uint16_t pattern,
                       Drive* drives) = find("AUTDLinkAuditFpgaDrivesAt");
  std::uint16_t (*audit_modulation_count)(Link*, std::uint8_t segment,
                                          std::uint16_t device) = find("AUTDLinkAuditFpgaModulationCycle");
  std::uint16_t (*audit_modulation_divider)(Link*, std::uint8_t segment,
                                            std::uint16_t device) = find("AUTDLinkAuditFpgaModulationFreqDivide");
  void (*audit_modulation)(Link*, std::uint8_t segment, std::uint16_t device,
                           std::uint8_t* samples) = find("AUTDLinkAuditFpgaModulationBuffer");
  std::uint16_t (*audit_phase_steps)(Link*,
                                     std::uint16_t device) = find("AUTDLinkAuditFpgaSilencerCompletionStepsPhase");
  std::uint16_t (*audit_intensity_steps)(Link*, std::uint16_t device) =
      find("AUTDLinkAuditFpgaSilencerCompletionStepsIntensity");
  bool (*audit_fixed_steps)(Link*, std::uint16_t device) = find("AUTDLinkAuditFpgaSilencerFixedCompletionStepsMode");
};

}  // namespace autd3

/// The vendor's library, loaded at run time. It stays in the process once it is in: it has threads of its own.
class Autd3Library {
 public:
  /// path     libautd3capi.so, or the folder that holds it, or an unpacked wheel (then pyautd3/bin below it)
  /// throws   InputError naming the file, and the symbol if one is missing: no such file, not a library, another
  ///          library, another version
  explicit Autd3Library(const std::string& path);

  /// The file loaded.
  const std::string& file() const { return file_; }
  /// The firmware it is made for, e.g. "v12.1.0".
  const std::string& firmware() const { return firmware_; }
  const autd3::Calls& call() const { return call_; }

  /// A link over TCP, by libautd3capi_link_remote.so in the same folder.
  /// address    "IP:PORT", a number, not a name
  /// patience   that it waits for a connection, and then for each answer [s]
  /// throws     InputError as the constructor; DeviceError with the library's reason
  autd3::Link* remote_link(const std::string& address, double patience) const;
  /// A link through TwinCAT, by libautd3capi_link_twincat.so in the same folder. Throws as remote_link.
  autd3::Link* twincat_link() const;

  /// The value of a result.
  /// throws   DeviceError "autd3-legacy: WHAT: REASON", the reason the library's
  template <class T>
  T value_of(const autd3::Result<T>& result, std::string_view what) const {
    if (result.error_length > 0) {
      throw DeviceError("autd3-legacy: " + std::string(what) + ": " + error_of(result.error, result.error_length));
    }
    return result.value;
  }

 private:
  std::string error_of(const void* error, std::uint32_t length) const;

  std::string file_;
  std::string folder_;
  autd3::Calls call_;
  std::string firmware_;
};

/// A duration for the library. seconds < 0: none, the library's own choice.
autd3::OptionalDuration autd3_duration(double seconds);

}  // namespace touchfield
