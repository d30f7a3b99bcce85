// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/svg_png.h"

#include <gsc/error.h>
#include "runtime/module/load_module.h"

#include <cairo.h>
#include <librsvg/rsvg.h>

#include <memory>

namespace gsc {

namespace {

constexpr double kPixelsPerUnit = 2; // PNG: sharp on paper and on dense screens

template <class T, void (*release)(T*)>
struct Release {
    void operator()(T* object) const { release(object); }
};
void releaseHandle(RsvgHandle* handle)
{
    g_object_unref(handle);
}
using Handle = std::unique_ptr<RsvgHandle, Release<RsvgHandle, releaseHandle>>;
using Surface = std::unique_ptr<cairo_surface_t, Release<cairo_surface_t, cairo_surface_destroy>>;
using Context = std::unique_ptr<cairo_t, Release<cairo_t, cairo_destroy>>;

[[noreturn]] void throwPicture(const std::string& name, const char* why)
{
    throw internalError(name, formatString("cannot be turned into a PNG (%s)", why), "it to be drawn");
}

cairo_status_t appendBytes(void* closure, const unsigned char* data, unsigned int length)
{
    try {
        static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
        return CAIRO_STATUS_SUCCESS;
    } catch (const std::bad_alloc&) { // must not pass through C
        return CAIRO_STATUS_NO_MEMORY;
    }
}

} // namespace

std::string pngOfSvg(const std::string& svg, const std::string& name)
{
    GError* error = nullptr;
    const Handle handle(rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error));
    if (!handle) {
        const std::string why = error ? error->message : "unknown";
        g_clear_error(&error);
        throwPicture(name, why.c_str());
    }
    double width = 0, height = 0;
    if (!rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height))
        throwPicture(name, "it has no size");
    const Surface surface(
        cairo_image_surface_create(CAIRO_FORMAT_RGB24, int(width * kPixelsPerUnit), int(height * kPixelsPerUnit)));
    const Context context(cairo_create(surface.get()));
    cairo_set_source_rgb(context.get(), 1, 1, 1);
    cairo_paint(context.get());
    cairo_scale(context.get(), kPixelsPerUnit, kPixelsPerUnit);
    const RsvgRectangle viewport{0, 0, width, height};
    if (!rsvg_handle_render_document(handle.get(), context.get(), &viewport, &error)) {
        const std::string why = error ? error->message : "unknown";
        g_clear_error(&error);
        throwPicture(name, why.c_str());
    }
    std::string png;
    const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), appendBytes, &png);
    if (status != CAIRO_STATUS_SUCCESS)
        throwPicture(name, cairo_status_to_string(status));
    return png;
}

namespace {

constexpr SvgPngFunctions kFunctions{pngOfSvg};

} // namespace

} // namespace gsc

GSC_EXPORT_MODULE(gsc::kFunctions)
