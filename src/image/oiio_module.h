// C interface of polymorph_oiio.so, the only file that links OpenImageIO. It is plain C, so that
// neither side sees the other's C++ types.
#pragma once

#include <cstddef>
#include <cstdint>

/// Version of this interface, incremented with every change; a module with another version is not
/// used.
#define PM_OIIO_INTERFACE 6

extern "C" {

enum PmOiioAttributeKind { PM_OIIO_STRING = 0, PM_OIIO_INT = 1, PM_OIIO_FLOAT = 2 };

struct PmOiioAttribute {
  const char* name;
  PmOiioAttributeKind kind;
  const char* text;  ///< PM_OIIO_STRING
  int integer;       ///< PM_OIIO_INT
  float real;        ///< PM_OIIO_FLOAT
};

struct PmOiioRequest {
  const char* format;  ///< OpenImageIO's reader, as in "jpeg"
  const void* bytes;   ///< the whole file
  std::size_t size;
  std::uint64_t
      max_bytes;  ///< limit of width * height * channels floats, checked before pixels are read
};

enum PmOiioFailure { PM_OIIO_GOOD = 0, PM_OIIO_BROKEN = 1, PM_OIIO_TOO_LARGE = 2 };

/// Owned by the module until polymorph_oiio_free.
struct PmOiioImage {
  PmOiioFailure failure;
  const char* error;  ///< the reason when `failure` is not PM_OIIO_GOOD; then nothing below is set
  int width;          ///< display window's width; pixels outside the data window are 0
  int height;
  int channels;
  const char* const* channel_names;  ///< names in the file's order
  const float* pixels;               ///< interleaved, row 0 on top; integer formats scaled to 0..1
  /// Pixels as integers of 8 bits, with straight alpha or without alpha. If not null, `pixels` is
  /// null.
  const unsigned char* codes;
  int integer_format;  ///< 1: pixels came from integers, so a transfer curve applies
  int straight_alpha;  ///< 1: colours are not premultiplied
  /// Number of pictures in the file: pages, animation frames, or parts that cannot be joined. This
  /// picture is the first. Counting ends at a thousand pictures, or when together they exceed the
  /// request's max_bytes.
  int picture_count;
  int count_is_cut;                    ///< 1: the file may have more than picture_count
  int part_count;                      ///< number of parts of a multi-part OpenEXR file, else 0
  const char* const* parts;            ///< name, size and channels of each part
  const unsigned char* is_id_channel;  ///< per channel, 1: whole numbers that are not scaled
                                       ///< (UINT); null: 0 for all channels
  int attribute_count;
  const PmOiioAttribute* attributes;
};

/// Types of the symbols, for dlsym.
using PmOiioInterfaceFunction = int();
using PmOiioDecodeFunction = PmOiioImage*(const PmOiioRequest*);
using PmOiioFreeFunction = void(PmOiioImage*);

PmOiioInterfaceFunction polymorph_oiio_interface;
PmOiioDecodeFunction
    polymorph_oiio_decode;  ///< never returns null; several threads may call it at once
PmOiioFreeFunction polymorph_oiio_free;

}  // extern "C"
