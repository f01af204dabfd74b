#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "sim/core/files.h"
#include "sim/run/sweep_files.h"
#include "sim/scene/sweep_reader.h"

namespace touchfield {

/// throws   IoError with this message unless `holds`
void require_io(bool holds, const std::string& message);

/// What the cases of a directory came to.
struct CaseRecords {
  std::map<int, SweepRecord> whole;
  std::map<int, std::string> damaged;  // what is wrong with those that are no longer what they were when they finished
};

/// The directory of a sweep, in which processes of several machines may work at a time:
///
///   sweep.json                 the plan; there before the first case
///   cases/00001/               a case: its results and case.json, which lists them with their checksums
///   cases/.00002.HOST.NUMBER/  one that is being computed
///   cases/.00002.lock          locked meanwhile, with FileLock
///   sweep.csv                  the table
///
/// A case gets its place by a rename after it has been flushed to the disk.
class SweepDirectory {
 public:
  /// Makes the directory, or opens it to continue.
  /// throws   InputError if it holds another plan than this one, or results of a sweep without a plan: nothing is then
  ///          changed. Also if it cannot be made or written to
  static SweepDirectory open(const std::string& path, const SweepPlan& plan);

  const std::string& path() const { return path_; }
  std::string file(const std::string& name) const { return path_ + "/" + name; }

  /// Takes a case for this process as long as the lock lives; nothing if another process has it.
  /// throws   InputError where the file system has no locks
  std::optional<FileLock> lock(int number) const;
  /// Lets go of a finished case.
  void unlock(int number, std::optional<FileLock>& lock) const;

  /// What there is of a case; nothing if it is not there, or an empty folder.
  /// throws   Error if it is damaged
  std::optional<SweepRecord> record(int number) const;

  /// A new empty folder for a case to be computed in.
  /// locked   whether this process has the lock of the case
  /// throws   IoError
  std::string scratch(int number, bool locked) const;

  /// Gives a finished case of a scratch folder its place. A case that another process has finished meanwhile stays. One
  /// that is damaged or has failed is replaced file by file; files that no case wrote stay.
  /// returns  why what is there cannot be replaced, and how to mend that; else empty
  /// throws   IoError if there is nothing; the scratch folder is then still there
  std::string land(int number, const std::string& scratch) const;

  /// Removes what processes left: half-written files, locks of finished cases, and scratch folders. A scratch folder
  /// goes if its case is finished, or if no process has locked it.
  /// throws   as lock
  void clear_leftovers(const std::map<int, SweepRecord>& known) const;

 private:
  explicit SweepDirectory(std::string path) : path_(std::move(path)) {}
  std::string lock_file(int number) const;

  std::string path_;
};

/// Finishes a scratch folder: case.json with the record, to which the files of the folder are added.
/// throws   IoError
void write_record(SweepRecord record, const std::string& scratch);

/// The cases in a directory, by number. A case is whole if its record can be read and each file that it lists has the
/// length and the CRC-32 in the record.
CaseRecords read_records(const std::string& directory);

/// The table of a directory as it is now.
/// throws   InputError if it holds no sweep, IoError if its plan cannot be read
SweepSummary read_sweep_summary(const std::string& directory);

}  // namespace touchfield
