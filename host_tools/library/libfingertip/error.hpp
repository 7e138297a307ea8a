/* Errors that a user can correct, as facts: a code for programs, and a line for people that states what is wrong. The program adds what to
 * do about it, since it knows its own options and its user's rights. Any other exception is a bug of ours. */
#pragma once

#include <stdexcept>
#include <string>

#pragma GCC visibility push(default)
namespace fingertip {

enum class ErrorCode {
  other, /* see the text */

  /* Ways to a fingertip. */
  no_port,            /* nothing has this name, or not any more */
  not_a_port,         /* something has, but it is no serial port */
  port_in_use,        /* by another program */
  permission_denied,  /* this user may not open it */
  cannot_open,        /* for the system's reason in the text */
  no_fingertip,       /* none is plugged in or named */
  several_fingertips, /* none was chosen; the text names them */
  not_simulated,      /* nothing is, of this name */
  no_such_fingertip,  /* none has the wanted serial number; the text names those that are there */
  other_fingertip,    /* the port's is not the wanted one, or not the one that was there before */
  no_driver,          /* on USB, but without a serial port */
  not_a_fingertip,    /* our USB ids, but not our interfaces */
  usb_failed,         /* libusb cannot go on */
  wrong_choice,       /* of fingertip and way, which exclude each other */
  not_shared,         /* no program serves it to others */
  share_denied,       /* a program does, but not to this user */
  shared_already,     /* another program serves it */
  cannot_share,       /* for the system's reason in the text */

  /* Conversations. */
  gone,            /* the port vanished */
  no_answer,       /* to a command, in all the time that it was given */
  other_version,   /* it speaks another version of the protocol */
  unknown_command, /* refused: to its firmware */
  refused_value,   /* refused: out of its firmware's range */
  not_now,         /* refused: in the state that it is in */
  refused,         /* for a reason that is newer than this library */

  /* Grippers. */
  gripper_silent,  /* no answer in time */
  gripper_garbled, /* an answer that is none: damaged, of another slave, to another question */
  gripper_refused, /* the gripper refuses */

  /* Values. */
  bad_value, /* the text has the good ones */

  /* Files. */
  cannot_read,        /* for the system's reason in the text */
  cannot_write,       /* the same, and nothing was written */
  file_exists,        /* and was not to be replaced */
  is_folder,          /* where a file is to be */
  write_undone,       /* a write failed, the file is as it was before */
  write_cut,          /* a write failed, the file holds all whole lines until then */
  write_torn,         /* a write failed, the file's last line is torn */
  not_a_recording,    /* nor a capture of the line */
  other_format,       /* of a recording: newer or older than this library */
  unread_kind,        /* a file that a recording may be in; the text has what makes it one */
  damaged_line,       /* of a recording: the lines after it can be read */
  damaged_head,       /* of a recording: without it no row can be read */
  several_in_file,    /* fingertips, and none was chosen; the text names them */
  no_such_in_file,    /* no fingertip of this serial number; the text names those in it */
  other_sensor_count, /* the rows of one file have equally many sensors */
  not_firmware,       /* no UF2 file, or none of ours */
  other_chip,         /* firmware for another chip than the RP2040 */
  damaged_firmware,
};

class Error : public std::runtime_error {
public:
  /* Facts may quote a whole file: of more than 600 characters the middle is left out. */
  Error(ErrorCode code, const std::string &facts)
      : std::runtime_error(facts.size() <= 600 ? facts : facts.substr(0, 300) + " ... " + facts.substr(facts.size() - 300)), code_(code) {}
  /* A text that is complete. */
  explicit Error(const std::string &text) : Error(ErrorCode::other, text) {}

  ErrorCode code() const { return code_; }

private:
  ErrorCode code_;
};

} // namespace fingertip
#pragma GCC visibility pop
