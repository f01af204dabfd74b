#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/core/own_directory.h"
#include "sim/scene/sweep_reader.h"
#include "sim/store/sweep_files.h"

namespace touchfield {

/// Part i of n of a sweep: the cases whose number is i modulo n.
struct Shard {
  int index = 1;  // from 1
  int count = 1;

  bool has(int number) const { return (number - index) % count == 0; }
};

/// What a sweep set out to do, as sweep.json in its directory keeps it; without `base`, the path of the scene file.
struct SweepIdentity : SweepPlan {
  std::string hash;  // plan_hash, the scenes in the words of version 1
  Shard shard;
  bool names_files = true;  // of the scenes
  int version = 3;          // of sweep.json: see has_exchanged_sides and has_earlier_parts
};

/// What the cases of a directory came to.
struct CaseRecords {
  std::map<int, SweepRecord> whole;
  std::map<int, std::string> damaged;  // what is wrong with those that are no longer what they were when they finished
};

/// The directory of a sweep or of one of its shards:
///
///   sweep.json            the plan; there before the first case
///   cases/00001/          a case: its run and case.json, there whole or not at all
///   cases/.00002.PID/     one that is being computed
///   sweep.lock            locked with the directory by the process that computes: for other machines and version 0.2
///   sweep.csv, sweep.h5   the table
///
/// Everything lands by a rename after it has been flushed to the disk. Nothing outside of the directory is written to or
/// removed, whatever links it holds.
class SweepDirectory {
 public:
  /// Makes the directory, or opens it to go on, and locks it.
  ///
  /// resume   go on with the same plan; without it a directory that holds a sweep is refused. A plan of the same texts
  ///          whose scenes name no files is the same though its hash is another: a version with other defaults made it
  /// throws   InputError if it holds a sweep and resume is false, or another plan than this one (naming the first
  ///          difference), if another process works in it, or if it cannot be made or written to
  static SweepDirectory open(const std::string& path, const SweepIdentity& identity, bool resume);

  const std::string& path() const { return own_.path(); }
  /// Whether a version began it whose `side: right` was a left hand.
  bool has_exchanged_sides() const { return version_ < 2; }
  /// Whether a version began it for which skin beyond keep_within was not there, and whose judge is `same` unless said.
  bool has_earlier_parts() const { return version_ < 3; }
  /// Whether a version with other defaults began it.
  bool of_other_defaults() const { return of_other_defaults_; }
  std::string file(const std::string& name) const { return path() + "/" + name; }

  CaseRecords records() const;

  /// A new empty folder for a case to be computed in.
  /// throws   IoError
  std::string scratch(int number) const;

  /// Puts a case in its place: its files are added to the record, the record is written into its scratch folder, which
  /// then gets the case's name; what was there before is removed.
  /// throws   IoError; the scratch folder is then still there
  void land(SweepRecord& record, const std::string& scratch) const;

  /// Removes a scratch folder and what is in it.
  static void drop(const std::string& scratch) noexcept;

 private:
  explicit SweepDirectory(const std::string& path);
  void clear_leftovers() const;

  OwnDirectory own_;
  int version_;  // of sweep.json
  bool of_other_defaults_ = false;
};

/// The directory of a sweep, of which nobody else writes files meanwhile. What killed processes left of its own files
/// half-written is removed.
/// lock_file, throws   as of OwnDirectory
OwnDirectory own_sweep_directory(const std::string& path, const std::string& lock_file = {});

/// The plan of a directory.
/// throws   InputError if it holds none, IoError if it cannot be read
SweepIdentity read_identity(const std::string& directory);

/// The cases in a directory, by number, without locking it. Each is whole if its record can be read and every file that
/// the record names is there, as long as it was and with the same CRC-32.
CaseRecords read_records(const std::string& directory);

/// The shards' directories in a directory, in order.
std::vector<std::string> shard_directories(const std::string& directory);

/// The directory of a shard: `directory` itself if there is only one.
std::string shard_directory(const std::string& directory, Shard shard);

}  // namespace touchfield
