// SPDX-License-Identifier: Apache-2.0
// Brings finished pictures to a display through Vulkan: the module gsc_present, loaded when it is first used, so that
// the player starts where there is no Vulkan, no GLFW and no display. A picture lies in memory of this process, or in
// memory of the display's GPU that is shared with the renderer. One copy brings it to the image that is shown, so its
// bytes stay unchanged. All calls come from one thread, the process's first.
#pragma once

#include "player/present/overlay.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

using DeviceUuid = std::array<unsigned char, 16>;

constexpr uint32_t kWindowWidth = 1280, kWindowHeight = 720; // default size of the window, pixels

struct PresenterOptions {
    std::string title;
    uint32_t width = kWindowWidth, height = kWindowHeight; // size of the window, pixels
    bool windowed = true;                                  // false: there is no window; images are read back
    bool waits_for_display = true;    // the shown picture changes only between two refreshes of the display
    std::optional<DeviceUuid> device; // GPU that draws the pictures; the display uses the same one if possible
};

// One event of keyboard, mouse or window. Codes of keys, buttons and modifiers are GLFW's.
struct InputEvent {
    enum class Kind : uint32_t { Key, Button, Move, Scroll };
    Kind kind = Kind::Key;
    int code = 0; // code of the key or button; for events Key and Button
    // true when a key or button was pressed, false when it was released; the repetition of a held key is no event
    bool down = false;
    int modifiers = 0; // modifier keys that were held, as GLFW's bits; for events Key and Button
    // place of the cursor in pixels of the picture, right and down (event Move); notches of the wheel (event Scroll)
    double x = 0, y = 0;
    bool overlay = false; // the overlay uses the event, too: a click on the panel, for instance
};

// State of a gamepad in GLFW's layout. Axes are left x, left y, right x, right y and two triggers, each -1 to 1; bit b
// of `buttons` is button b.
struct GamepadState {
    bool present = false;
    std::array<float, 6> axes{};
    uint32_t buttons = 0;
};

struct WindowInput {
    std::vector<InputEvent> events; // input events since the last poll()
    GamepadState gamepad;
    uint32_t width = 0, height = 0;   // size of the picture in pixels; 0 while the window is minimised
    float scale = 1;                  // scale of text on this screen; 1 = 96 dots per inch
    bool exposed = false;             // the window's content is lost: show a frame again
    bool closed = false;              // true once the person has asked to close the window
    std::vector<std::string> dropped; // paths of files that were dropped on the window since the last poll()
};

// A block of the display GPU's memory that a renderer, through CUDA for instance, can open.
struct SharedBlock {
    uint32_t id = 0;
    size_t bytes = 0; // size of the block, at least as many bytes as were asked for
    int file = -1;    // file descriptor by which CUDA or Vulkan imports the block, and which the importer then owns
};

// A picture to show: rows of `width` x 4 bytes without gaps. Bytes of a pixel are red, green, blue, alpha, or in the
// order that a headset wants (HeadsetFacts::pixels).
struct ShownPicture {
    // pixels, if they lie in memory of this process; null = they lie in a shared block
    const std::byte* pixels = nullptr;
    uint32_t block = 0;
    size_t offset = 0;  // offset of the picture's pixels in the shared block, bytes
    uint64_t ready = 0; // the display waits until the shared semaphore has this value before it reads; 0 = no wait
    uint32_t width = 0, height = 0;
    uint32_t x = 0, y = 0; // place of the picture's top left corner on the canvas, pixels
    // Depths as FrameTarget has them, in memory of this process, rows without gaps, for a display that wants them;
    // null: none
    const float* depth = nullptr;
};

struct FrameToShow {
    std::span<const ShownPicture> pictures;
    // Size in pixels of the canvas that the pictures lie on; the canvas is scaled to a window of another size. Parts
    // without a picture are black; without a window pictures must cover all of it.
    uint32_t width = 0, height = 0;
    bool reads_back = false; // keep the displayed canvas, without the overlay, for readBack()
};

struct PresentTimes {
    double copy_ms = 0; // GPU time in ms of the copies alone, in the last frame that has finished
};

// Memory of the display's GPU that a renderer writes pictures to.
class SharedMemory {
public:
    virtual ~SharedMemory() = default;

    [[nodiscard]] virtual bool sharesMemory() const = 0; // true if memory can be shared with the GPU that was asked for

    // Allocates a block to share. Throws Error: OutOfMemory, or Unsupported if sharesMemory() is false.
    virtual SharedBlock makeShared(size_t bytes) = 0;
    virtual void freeShared(uint32_t id) = 0; // frees a block, once the display has read it
    // file descriptor of a timeline semaphore that starts at 0; whoever imports it owns it
    virtual int semaphoreFile() = 0;
    // Call it when the renderer has gone: nobody will signal the semaphore any more, so the display must not wait for
    // it.
    virtual void importerGone() = 0;
};

class Presenter : public SharedMemory {
public:
    [[nodiscard]] virtual std::string deviceName() const = 0;
    [[nodiscard]] virtual bool readsBack() const = 0; // true if frames may set FrameToShow::reads_back

    // Returns the input since the last call; waits up to `seconds` for some. Throws Error(Device) if the display has
    // gone.
    virtual WindowInput poll(double seconds) = 0;

    // Shows a frame; returns when the display can take the next one. Returns false if nothing was shown, because the
    // window is minimised or being resized. `overlay`, if not null, is drawn over the frame and receives the person's
    // changes. Throws Error: Device if display or GPU are lost, OutOfMemory.
    virtual bool show(const FrameToShow& frame, Overlay* overlay) = 0;

    // Returns the last frame that was shown with reads_back, after waiting for it: `height` rows of `width` x 4 bytes,
    // red first.
    virtual std::vector<std::byte> readBack(uint32_t& width, uint32_t& height) = 0;

    virtual void setTitle(const std::string& title) = 0;
    virtual void toggleFullScreen() = 0; // the window covers the screen that it lies on, or is as it was before

    virtual PresentTimes times() = 0;
    virtual void finish() = 0; // waits until no picture's memory is being read
};

struct PresentFunctions {
    // Opens the display. Throws Error: Unsupported if Vulkan 1.2 or a display is missing, naming which; Device.
    std::unique_ptr<Presenter> (*open)(const PresenterOptions& options);
};

} // namespace gsc
