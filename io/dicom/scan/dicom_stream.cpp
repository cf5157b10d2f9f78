// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_stream.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcerror.h>
#include <dcmtk/dcmdata/dcistrmf.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace tetwarp {
namespace {

/// Bytes of a file that are in memory.
class Plain {
 public:
  explicit Plain(std::span<const std::byte> bytes) : bytes_(bytes) {}
  virtual ~Plain() = default;
  /// All bytes up to `end`, or as many as there are.
  virtual std::span<const std::byte> first(std::size_t end) { return bytes_.first(std::min(end, bytes_.size())); }
  /// How many bytes there are from a place on. Of data that are inflated on demand, at least one if there are any.
  virtual std::size_t count_from(std::size_t at) { return bytes_.size() - at; }
  virtual bool is_whole() const { return true; }
  virtual bool is_too_large() const { return false; }

 private:
  std::span<const std::byte> bytes_;
};

/// The bytes of a deflated data set, inflated as far as they are used (PS3.5 A.5: there is no header of zlib).
class Inflated final : public Plain {
 public:
  /// @param packed  gives the deflated bytes
  /// @param limit  no more bytes than these are inflated
  Inflated(std::unique_ptr<DcmProducer> packed, std::size_t limit)
      : Plain({}), producer_(std::move(packed)), limit_(limit), packed_(kPiece), piece_(kPiece) {
    status_ = inflateInit2(&stream_, -MAX_WBITS);
  }
  ~Inflated() override { inflateEnd(&stream_); }
  Inflated(const Inflated&) = delete;
  Inflated& operator=(const Inflated&) = delete;

  std::span<const std::byte> first(std::size_t end) override {
    while (plain_.size() < end && status_ == Z_OK && !is_too_large_) add_piece();
    return std::span(plain_).first(std::min(end, plain_.size()));
  }
  std::size_t count_from(std::size_t at) override { return first(at + kPiece).size() - at; }
  /// Whether the deflated data came to their end.
  bool is_whole() const override { return status_ == Z_STREAM_END; }
  bool is_too_large() const override { return is_too_large_; }

 private:
  static constexpr std::size_t kPiece = 1 << 16;

  void add_piece() {
    if (stream_.avail_in == 0) {
      stream_.next_in = packed_.data();
      stream_.avail_in = static_cast<uInt>(producer_->read(packed_.data(), kPiece));
    }
    stream_.next_out = piece_.data();
    stream_.avail_out = kPiece;
    status_ = inflate(&stream_, Z_NO_FLUSH);
    const std::span<const std::byte> got = std::as_bytes(std::span(piece_).first(kPiece - stream_.avail_out));
    is_too_large_ = got.size() > limit_ - plain_.size();
    if (!is_too_large_) plain_.insert(plain_.end(), got.begin(), got.end());
  }

  std::unique_ptr<DcmProducer> producer_;
  std::size_t limit_;
  std::vector<Bytef> packed_, piece_;
  std::vector<std::byte> plain_;
  z_stream stream_{};
  int status_;
  bool is_too_large_ = false;
};

/// Gives DCMTK the bytes of an open file.
class FileProducer final : public DcmProducer {
 public:
  explicit FileProducer(std::shared_ptr<OpenedFile> file) : file_(std::move(file)) {}

  OFBool good() const override { return file_->problem().empty() && !cut_short_; }
  OFCondition status() const override {
    if (!file_->problem().empty()) return makeOFCondition(OFM_dcmdata, 18, OF_error, file_->problem().c_str());
    return cut_short_ ? EC_InvalidStream : EC_Normal;
  }
  OFBool eos() override { return at_ == file_->size(); }
  offile_off_t avail() override { return static_cast<offile_off_t>(file_->size() - at_); }
  offile_off_t read(void* buffer, offile_off_t length) override {
    const offile_off_t wanted = std::min(length, avail());
    if (wanted <= 0) return 0;
    const std::size_t count = file_->read(at_, {static_cast<std::byte*>(buffer), static_cast<std::size_t>(wanted)});
    cut_short_ = count < static_cast<std::size_t>(wanted);  // the file became shorter after it was opened
    at_ += count;
    return static_cast<offile_off_t>(count);
  }
  offile_off_t skip(offile_off_t length) override {
    const offile_off_t count = std::min(length, avail());
    at_ += static_cast<std::uint64_t>(count);
    return count;
  }
  void putback(offile_off_t count) override { at_ -= static_cast<std::uint64_t>(count); }

 private:
  std::shared_ptr<OpenedFile> file_;
  std::uint64_t at_ = 0;
  bool cut_short_ = false;
};

class MemoryProducer final : public DcmProducer {
 public:
  MemoryProducer(std::shared_ptr<Plain> plain, std::size_t at) : plain_(std::move(plain)), at_(at) {}

  OFBool good() const override { return OFTrue; }
  OFCondition status() const override { return EC_Normal; }
  OFBool eos() override { return avail() == 0; }
  offile_off_t avail() override { return static_cast<offile_off_t>(plain_->count_from(at_)); }
  offile_off_t read(void* buffer, offile_off_t length) override {
    const std::span<const std::byte> bytes = next(length);
    if (!bytes.empty()) std::memcpy(buffer, bytes.data(), bytes.size());
    at_ += bytes.size();
    return static_cast<offile_off_t>(bytes.size());
  }
  offile_off_t skip(offile_off_t length) override {
    const std::size_t count = next(length).size();
    at_ += count;
    return static_cast<offile_off_t>(count);
  }
  void putback(offile_off_t count) override { at_ -= static_cast<std::size_t>(count); }

  const std::shared_ptr<Plain>& plain() const { return plain_; }
  std::size_t at() const { return at_; }

 private:
  std::span<const std::byte> next(offile_off_t length) {
    return plain_->first(at_ + static_cast<std::size_t>(std::max<offile_off_t>(length, 0))).subspan(at_);
  }

  std::shared_ptr<Plain> plain_;
  std::size_t at_;
};

/// DCMTK's stream, except that it keeps what it inflates: DCMTK can go back to any place in memory.
///
/// It also refuses sequences that lie too deep. DCMTK calls itself for every item within an item, as deep as the file
/// says, and each of its calls sets a mark where a tag begins. The addresses of the calls' stack frames tell how many
/// of them are under way.
class DicomStream final : public DcmInputStream {
 public:
  explicit DicomStream(const std::shared_ptr<OpenedFile>& file)
      : DcmInputStream(nullptr), file_(file->path().c_str()), producer_(std::make_unique<FileProducer>(file)) {}
  DicomStream(const std::shared_ptr<Plain>& plain, std::size_t at)
      : DcmInputStream(nullptr), producer_(std::make_unique<MemoryProducer>(plain, at)) {}

  void limit_inflated(std::size_t bytes) { inflated_limit_ = bytes; }

  OFBool good() const override { return producer_->good() && !is_too_deep() && !has_long_type_; }
  OFCondition status() const override {
    return is_too_deep() || has_long_type_ ? EC_InvalidStream : producer_->status();
  }
  OFBool eos() override { return producer_->eos(); }
  offile_off_t avail() override { return producer_->avail(); }
  offile_off_t read(void* buffer, offile_off_t length) override {
    return advanced(buffer == nullptr ? 0 : producer_->read(buffer, length));
  }
  offile_off_t skip(offile_off_t length) override { return advanced(producer_->skip(length)); }
  offile_off_t tell() const override { return tell_; }
  void mark() override {
    mark_ = tell_;
    const auto frame = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
    while (!frames_.empty() && frames_.back() < frame) frames_.pop_back();  // the stack grows downwards
    if (frames_.empty() || frames_.back() != frame) frames_.push_back(frame);
    deepest_ = std::max(deepest_, frames_.size());
    has_long_type_ = has_long_type_ || begins_long_type();
  }
  void putback() override {
    producer_->putback(tell_ - mark_);
    tell_ = mark_;
  }
  OFCondition installCompressionFilter(E_StreamCompression filter) override {
    if (filter == ESC_none) return EC_Normal;
    inflated_ = std::make_shared<Inflated>(std::move(producer_), inflated_limit_);
    producer_ = std::make_unique<MemoryProducer>(inflated_, 0);
    return EC_Normal;
  }
  DcmInputStreamFactory* newFactory() const override;

  /// Whether sequences are nested deeper than kDeepestSequence.
  bool is_too_deep() const {
    constexpr std::size_t kOutside = 4;                 // calls for the data set, and for what is read before it
    return deepest_ > 2 * kDeepestSequence + kOutside;  // a sequence takes a call for itself, and one for its items
  }
  /// Whether a Directory Record Type (0004,1430) is longer than VR CS allows, or has another VR. DCMTK 3.6.7 cuts it to
  /// its length, and throws std::out_of_range if it is more than twice as long.
  bool has_long_type() const { return has_long_type_; }
  /// The inflated bytes; null if the data set is not deflated.
  const Plain* inflated() const { return inflated_.get(); }

 private:
  /// Looks whether a Directory Record Type that DCMTK cannot cut comes next, in every encoding of tags. An implicit
  /// length whose bytes spell "CS" is taken for that VR.
  bool begins_long_type() {
    std::array<std::uint8_t, 8> b{};
    const offile_off_t count = producer_->read(b.data(), b.size());
    producer_->putback(count);
    const bool is_little = b[0] == 4 && b[1] == 0 && b[2] == 0x30 && b[3] == 0x14;
    const bool is_big = b[0] == 0 && b[1] == 4 && b[2] == 0x14 && b[3] == 0x30;
    if (count < 8 || !(is_little || is_big)) return false;
    const bool is_code = b[4] == 'C' && b[5] == 'S';
    constexpr int kLongest = 16;
    if (is_code) return (is_little ? b[6] | b[7] << 8 : b[7] | b[6] << 8) > kLongest;
    const bool is_implicit = is_little && b[5] == 0 && b[6] == 0 && b[7] == 0;
    return !is_implicit || b[4] > kLongest;
  }
  offile_off_t advanced(offile_off_t count) {
    tell_ += count;
    return count;
  }

  OFFilename file_;
  std::unique_ptr<DcmProducer> producer_;
  std::shared_ptr<Plain> inflated_;
  std::size_t inflated_limit_ = 0, deepest_ = 0;
  bool has_long_type_ = false;
  std::vector<std::uintptr_t> frames_;
  offile_off_t tell_ = 0, mark_ = 0;
};

/// Makes streams that begin at a place in memory.
class MemoryFactory final : public DcmInputStreamFactory {
 public:
  explicit MemoryFactory(const MemoryProducer& producer) : plain_(producer.plain()), at_(producer.at()) {}
  DcmInputStream* create() const override { return new DicomStream(plain_, at_); }
  DcmInputStreamFactory* clone() const override { return new MemoryFactory(*this); }
  /// DCMTK uses this to decide whether it has a file that it can keep open; it has none here.
  DcmInputStreamFactoryType ident() const override { return DFT_DcmInputTempFileStreamFactory; }

 private:
  std::shared_ptr<Plain> plain_;
  std::size_t at_;
};

DcmInputStreamFactory* DicomStream::newFactory() const {
  if (const auto* memory = dynamic_cast<const MemoryProducer*>(producer_.get())) return new MemoryFactory(*memory);
  return new DcmInputFileStreamFactory(file_, tell_);
}

OFCondition refusal(const std::string& reason) {
  return {OFM_dcmdata, EC_CorruptedData.theCode, OF_error, reason.c_str()};
}

/// Reads a data set up to a tag. DCMTK throws no exceptions of its own, but those of strings that it cuts wrongly pass
/// through it, and it loses memory. What is known to bring that about is refused before (DicomStream::has_long_type).
OFCondition read_until(DcmFileFormat& format, DicomStream& stream, const DcmTagKey& until) {
  try {
    return format.readUntilTag(stream, EXS_Unknown, EGL_noChange, DCM_MaxReadLength, until);
  } catch (const std::logic_error&) {
    return refusal("a value that DCMTK cannot take");
  }
}

DicomRead load(DcmFileFormat& format, DicomStream& stream, const DcmTagKey& until, std::size_t inflated_limit) {
  if (stream.status().bad()) return {stream.status()};
  stream.limit_inflated(inflated_limit);
  format.transferInit();
  OFCondition result = read_until(format, stream, until);
  format.transferEnd();
  const auto rest = static_cast<std::size_t>(stream.avail());
  const Plain* inflated = stream.inflated();
  if (stream.is_too_deep()) {
    result = refusal("sequences in sequences, more than " + std::to_string(kDeepestSequence) + " deep");
  } else if (stream.has_long_type()) {
    result = refusal("a Directory Record Type (0004,1430) of more than 16 bytes");
  } else if (inflated && inflated->is_too_large()) {
    result = refusal("the data set inflates to more than " + std::to_string(inflated_limit >> 20) + " MiB");
  } else if (result.good() && rest == 0 && inflated && !inflated->is_whole()) {
    result = EC_CorruptedData;
  }
  return {result, rest};
}

}  // namespace

DicomRead parse_dicom(DcmFileFormat& format, const std::shared_ptr<OpenedFile>& file, const DcmTagKey& until,
                      E_FileReadMode mode, std::size_t inflated_limit) {
  DicomStream stream(file);
  format.setReadMode(mode);
  return load(format, stream, until, inflated_limit);
}

DicomRead parse_dicom(DcmFileFormat& format, const std::filesystem::path& file, const DcmTagKey& until,
                      E_FileReadMode mode, std::size_t inflated_limit) {
  return parse_dicom(format, std::make_shared<OpenedFile>(file), until, mode, inflated_limit);
}

DicomRead parse_dicom(DcmFileFormat& format, std::span<const std::byte> bytes, const DcmTagKey& until,
                      std::size_t inflated_limit) {
  DicomStream stream(std::make_shared<Plain>(bytes), 0);
  DicomRead read = load(format, stream, until, inflated_limit);
  if (read.result.good()) read.result = format.loadAllDataIntoMemory();  // cheap, for all of them lie within the file
  return read;
}

}  // namespace tetwarp
