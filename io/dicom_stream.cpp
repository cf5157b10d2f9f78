#include "io/dicom_stream.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcistrmf.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

namespace tetwarp {
namespace {

/// Bytes, and what keeps them alive if they need that.
struct Memory {
  std::shared_ptr<const std::vector<std::byte>> owner;
  std::span<const std::byte> bytes;
};

class MemoryProducer final : public DcmProducer {
 public:
  MemoryProducer(Memory memory, std::size_t at) : memory_(std::move(memory)), at_(at) {}

  OFBool good() const override { return OFTrue; }
  OFCondition status() const override { return EC_Normal; }
  OFBool eos() override { return at_ == memory_.bytes.size(); }
  offile_off_t avail() override { return static_cast<offile_off_t>(memory_.bytes.size() - at_); }
  offile_off_t read(void* buffer, offile_off_t length) override {
    const offile_off_t count = std::min(length, avail());
    if (count > 0) std::memcpy(buffer, memory_.bytes.data() + at_, static_cast<std::size_t>(count));
    return skip(count);
  }
  offile_off_t skip(offile_off_t length) override {
    const offile_off_t count = std::min(length, avail());
    at_ += static_cast<std::size_t>(count);
    return count;
  }
  void putback(offile_off_t count) override { at_ -= static_cast<std::size_t>(count); }

  const Memory& memory() const { return memory_; }
  std::size_t at() const { return at_; }

 private:
  Memory memory_;
  std::size_t at_;
};

/// All that is left of a producer, inflated (PS3.5 A.5: no header of zlib). @param whole  whether it came to its end
Memory inflated(DcmProducer& producer, bool& whole) {
  constexpr std::size_t kPiece = 1 << 16;
  const auto plain = std::make_shared<std::vector<std::byte>>();
  std::vector<Bytef> packed(kPiece), piece(kPiece);
  z_stream stream{};
  int status = inflateInit2(&stream, -MAX_WBITS);
  while (status == Z_OK) {
    if (stream.avail_in == 0) {
      stream.next_in = packed.data();
      stream.avail_in = static_cast<uInt>(producer.read(packed.data(), kPiece));
    }
    stream.next_out = piece.data();
    stream.avail_out = kPiece;
    status = inflate(&stream, Z_NO_FLUSH);
    const std::span<const std::byte> got = std::as_bytes(std::span(piece).first(kPiece - stream.avail_out));
    plain->insert(plain->end(), got.begin(), got.end());
  }
  whole = status == Z_STREAM_END;
  inflateEnd(&stream);
  return {plain, *plain};
}

/// DCMTK's stream, except that a compressed part is inflated as soon as it begins: what is in memory can be gone back
/// to.
class DicomStream final : public DcmInputStream {
 public:
  explicit DicomStream(const OFFilename& file)
      : DcmInputStream(nullptr), file_(file), producer_(std::make_unique<DcmFileProducer>(file)) {}
  DicomStream(const Memory& memory, std::size_t at)
      : DcmInputStream(nullptr), producer_(std::make_unique<MemoryProducer>(memory, at)) {}

  OFBool good() const override { return producer_->good(); }
  OFCondition status() const override { return producer_->status(); }
  OFBool eos() override { return producer_->eos(); }
  offile_off_t avail() override { return producer_->avail(); }
  offile_off_t read(void* buffer, offile_off_t length) override {
    return advanced(buffer == nullptr ? 0 : producer_->read(buffer, length));
  }
  offile_off_t skip(offile_off_t length) override { return advanced(producer_->skip(length)); }
  offile_off_t tell() const override { return tell_; }
  void mark() override { mark_ = tell_; }
  void putback() override {
    producer_->putback(tell_ - mark_);
    tell_ = mark_;
  }
  OFCondition installCompressionFilter(E_StreamCompression filter) override {
    if (filter == ESC_none) return EC_Normal;
    producer_ = std::make_unique<MemoryProducer>(inflated(*producer_, whole_), 0);
    return EC_Normal;
  }
  DcmInputStreamFactory* newFactory() const override;

  /// Whether what was compressed, if anything, could be inflated to its end.
  bool whole() const { return whole_; }

 private:
  offile_off_t advanced(offile_off_t count) {
    tell_ += count;
    return count;
  }

  OFFilename file_;
  std::unique_ptr<DcmProducer> producer_;
  offile_off_t tell_ = 0, mark_ = 0;
  bool whole_ = true;
};

/// Goes back to a place in memory.
class MemoryFactory final : public DcmInputStreamFactory {
 public:
  explicit MemoryFactory(const MemoryProducer& producer) : memory_(producer.memory()), at_(producer.at()) {}
  DcmInputStream* create() const override { return new DicomStream(memory_, at_); }
  DcmInputStreamFactory* clone() const override { return new MemoryFactory(*this); }
  /// DCMTK asks it to know whether there is a file that it can keep open.
  DcmInputStreamFactoryType ident() const override { return DFT_DcmInputTempFileStreamFactory; }

 private:
  Memory memory_;
  std::size_t at_;
};

DcmInputStreamFactory* DicomStream::newFactory() const {
  if (const auto* memory = dynamic_cast<const MemoryProducer*>(producer_.get())) return new MemoryFactory(*memory);
  return new DcmInputFileStreamFactory(file_, tell_);
}

DicomRead load(DcmFileFormat& format, DicomStream& stream, const DcmTagKey& until) {
  if (stream.status().bad()) return {stream.status()};
  format.transferInit();
  const OFCondition result = format.readUntilTag(stream, EXS_Unknown, EGL_noChange, DCM_MaxReadLength, until);
  format.transferEnd();
  const auto rest = static_cast<std::size_t>(stream.avail());
  return {result.good() && rest == 0 && !stream.whole() ? EC_CorruptedData : result, rest};
}

}  // namespace

DicomRead parse_dicom(DcmFileFormat& format, const std::filesystem::path& file, const DcmTagKey& until,
                      E_FileReadMode mode) {
  DicomStream stream(OFFilename(file.c_str()));
  format.setReadMode(mode);
  return load(format, stream, until);
}

DicomRead parse_dicom(DcmFileFormat& format, std::span<const std::byte> bytes, const DcmTagKey& until) {
  DicomStream stream(Memory{nullptr, bytes}, 0);
  DicomRead read = load(format, stream, until);
  if (read.result.good()) read.result = format.loadAllDataIntoMemory();  // all of them lie within the file
  return read;
}

}  // namespace tetwarp
