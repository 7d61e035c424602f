//! `rtsl debug`: sessions from scripts. The page on debugging has further ones.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

const SUMMED: &str = "class Summed : rt_Texture;
public int count = 3;
float square(float x) { return x * x; }
void lookup() {
    float sum = 0.0;
    for (int i = 0; i < count; i++) {
        float term = square(float(i));
        sum += term;
    }
    print(\"sum {}\", sum);
    rt_TextureColor = color(sum / rt_TextureUV.x);
}
";

fn folder() -> Folder {
    let folder = Folder::new("debug");
    folder.write("summed.rtsl", SUMMED);
    folder
}

#[test]
fn forwards_and_backwards() {
    let script = "next 2\nstep\nwhere\nprint x\nup\ndown\nfinish\nback\nlist 6\norigin sum\nend\nlocals\nquit\n";
    let arguments = ["debug", "summed.rtsl", "lookup", "--state", "rt_TextureUV=0.5,0"];
    folder().run_with(&arguments, script).exits(DONE).prints(expect![[r#"
        rt_FloatTextureValue = 10.0
        rt_TextureColor = [10.0,10.0,10.0]
        Summed.lookup at summed.rtsl:5, statement 0 of 24
        ->    5      float sum = 0.0;
        (rtsl) next 2
        Summed.lookup at summed.rtsl:7, statement 3 of 24
              6      for (int i = 0; i < count; i++) {                 i = 0, true
        ->    7          float term = square(float(i));                i = 0
        (rtsl) step
        square at summed.rtsl:3, statement 4 of 24
        ->    3  float square(float x) { return x * x; }               x = 0.0
        (rtsl) where
        -> 0  square at summed.rtsl:3
           1  Summed.lookup at summed.rtsl:7
        (rtsl) print x
        x = 0.0
        (rtsl) up
        Summed.lookup at summed.rtsl:7
        ->    7          float term = square(float(i));                i = 0
        (rtsl) down
        square at summed.rtsl:3
        ->    3  float square(float x) { return x * x; }               x = 0.0
        (rtsl) finish
        Summed.lookup at summed.rtsl:8, statement 6 of 24
              7          float term = square(float(i));                term = 0.0
        ->    8          sum += term;                                  sum = 0.0, term = 0.0
        (rtsl) back
        Summed.lookup at summed.rtsl:7, statement 3 of 24
              6      for (int i = 0; i < count; i++) {                 i = 0, true
        ->    7          float term = square(float(i));                i = 0
        (rtsl) list 6
              1  class Summed : rt_Texture;
              2  public int count = 3;
              3  float square(float x) { return x * x; }
              4  void lookup() {
              5      float sum = 0.0;                                  sum = 0.0
              6      for (int i = 0; i < count; i++) {                 i = 0, true
        ->    7          float term = square(float(i));                i = 0
              8          sum += term;
              9      }
             10      print("sum {}", sum);
             11      rt_TextureColor = color(sum / rt_TextureUV.x);
        (rtsl) origin sum
        Summed.lookup at summed.rtsl:5, statement 0 of 24
        ->    5      float sum = 0.0;
        (rtsl) end
        Summed.lookup at summed.rtsl:12, statement 23 of 24
             11      rt_TextureColor = color(sum / rt_TextureUV.x);    rt_TextureColor = (10.0, 10.0, 10.0)
        ->   12  }
        (rtsl) locals
        locals
          sum = 5.0
        members
          count = 3
        state read
          rt_TextureUV = (0.5, 0.0)
        state set
          rt_TextureColor = (10.0, 10.0, 10.0)
        (rtsl) quit
    "#]]);
}

#[test]
fn breakpoints() {
    let script = "# A comment.
break 8 if i == 2
break square
break summed.rtsl:1
break elsewhere.rtsl:3
breakpoints
delete 2
delete 3
continue
print term + sum
catch nan
catch print
continue
uncatch print
continue
reverse-continue
delete
files
";
    let arguments = ["debug", "summed.rtsl", "lookup"];
    // One of the commands is wrong.
    folder().run_with(&arguments, script).exits(INPUT_AT_FAULT).prints(expect![[r#"
        rt_FloatTextureValue = inf
        rt_TextureColor = ["Infinity","Infinity","Infinity"]
        Summed.lookup at summed.rtsl:5, statement 0 of 24
        ->    5      float sum = 0.0;
        (rtsl) # A comment.
        (rtsl) break 8 if i == 2
        breakpoint 1 at summed.rtsl:8
        (rtsl) break square
        breakpoint 2 at square
        (rtsl) break summed.rtsl:1
        breakpoint 3 at summed.rtsl:3
        (rtsl) break elsewhere.rtsl:3
        error: no text `elsewhere.rtsl` takes part; `files` lists those that do
        (rtsl) breakpoints
        1  summed.rtsl:8 if i == 2
        2  square
        3  summed.rtsl:3
        (rtsl) delete 2
        (rtsl) delete 3
        (rtsl) continue
        breakpoint 1
        Summed.lookup at summed.rtsl:8, statement 18 of 24
              7          float term = square(float(i));                term = 4.0
        ->    8          sum += term;                                  sum = 1.0, term = 4.0
        (rtsl) print term + sum
        term + sum = 5.0
        (rtsl) catch nan
        (rtsl) catch print
        (rtsl) continue
        this statement prints
        Summed.lookup at summed.rtsl:10, statement 21 of 24
              6      for (int i = 0; i < count; i++) {                 i = 3, false
        ->   10      print("sum {}", sum);                             sum = 5.0
        (rtsl) uncatch print
        (rtsl) continue
        summed.rtsl:10: Summed.lookup: sum 5.0
        this statement makes inf of finite numbers: sum / rt_TextureUV.x
        Summed.lookup at summed.rtsl:11, statement 22 of 24
             10      print("sum {}", sum);                             prints "sum 5.0"
        ->   11      rt_TextureColor = color(sum / rt_TextureUV.x);    sum = 5.0, rt_TextureUV = (0.0, 0.0)
        (rtsl) reverse-continue
        breakpoint 1
        Summed.lookup at summed.rtsl:8, statement 18 of 24
              7          float term = square(float(i));                term = 4.0
        ->    8          sum += term;                                  sum = 1.0, term = 4.0
        (rtsl) delete
        (rtsl) files
        summed.rtsl
        (rtsl) 
    "#]]);
}

/// Of a function, the session has its statements alone, not those of the method that calls it.
#[test]
fn functions_that_are_no_methods() {
    let script = "where\nlist\nbreak 99\nstep\nlocals\nstep\n";
    let arguments = ["debug", "summed.rtsl", "square", "--arg", "x=3"];
    folder().run_with(&arguments, script).exits(INPUT_AT_FAULT).prints(expect![[r#"
        result = 9.0
        square at summed.rtsl:3, statement 0 of 2
        ->    3  float square(float x) { return x * x; }               x = 3.0
        (rtsl) where
        -> 0  square at summed.rtsl:3
        (rtsl) list
              1  class Summed : rt_Texture;
              2  public int count = 3;
        ->    3  float square(float x) { return x * x; }               x = 3.0
              4  void lookup() {
              5      float sum = 0.0;
              6      for (int i = 0; i < count; i++) {
              7          float term = square(float(i));
              8          sum += term;
        (rtsl) break 99
        error: `summed.rtsl` has no statement from line 99 on
        (rtsl) step
        the end of the recording
        square at summed.rtsl:3, statement 1 of 2
        ->    3  float square(float x) { return x * x; }               x = 3.0, returns 9.0
        (rtsl) locals
        locals
          x = 3.0
        returned
          result = 9.0
        (rtsl) step
        the end of the recording
        square at summed.rtsl:3, statement 1 of 2
        ->    3  float square(float x) { return x * x; }               x = 3.0, returns 9.0
        (rtsl) 
    "#]]);
}

#[test]
fn a_script_in_a_file() {
    let folder = folder();
    folder.write("script.txt", "end\nprint sum\n");
    let arguments = ["debug", "summed.rtsl", "lookup", "--commands", "script.txt"];
    let output = folder.run(&arguments).exits(DONE).output();
    assert!(output.contains("(rtsl) print sum\nsum = 5.0\n"), "{output}");
}

#[test]
fn later_parts_of_recordings() {
    let arguments = ["debug", "summed.rtsl", "lookup", "--skip", "30", "--keep", "10"];
    let ran = folder().run_with(&arguments, "locals\nend\n").exits(DONE);
    assert!(ran.errors().contains("the recording begins after 30 entries"), "{}", ran.errors());
    assert!(ran.errors().contains("the recording is cut"), "{}", ran.errors());
    let past = ["debug", "summed.rtsl", "lookup", "--skip", "100000"];
    let ran = folder().run_with(&past, "").exits(INPUT_AT_FAULT);
    expect![[r#"
        `lookup`: no statement has run after the 52 entries that are skipped
    "#]]
    .assert_eq(&ran.errors());
}

#[test]
fn wrong_uses() {
    let folder = folder();
    folder.run(&["debug", "summed.rtsl"]).exits(WRONG_USAGE);
    folder.run(&["debug", "summed.rtsl", "lookup", "--sample", "1"]).exits(WRONG_USAGE);
    folder.run(&["debug", "summed.rtsl", "lookup", "--keep", "0"]).exits(WRONG_USAGE);
    folder.run(&["debug", "summed.rtsl", "lookup", "--commands", "none"]).exits(WRONG_USAGE);
    let ran = folder.run(&["debug", "summed.rtsl", "nothing"]).exits(INPUT_AT_FAULT);
    assert!(ran.errors().contains("no method or function `nothing`"), "{}", ran.errors());
    let empty = "class Empty : rt_Texture { }; class Full : Empty { void lookup() { } };";
    folder.write("empty.rtsl", empty);
    let arguments = ["debug", "empty.rtsl", "lookup", "--class", "Empty"];
    let ran = folder.run(&arguments).exits(INPUT_AT_FAULT);
    expect![[r#"
        error[E0508]: `Empty` has no method `lookup`
         = note: `Empty` has no methods
    "#]]
    .assert_eq(&ran.errors());
}
